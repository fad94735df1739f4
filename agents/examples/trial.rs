use std::time::Instant;
use swath_agents::registry::AgentSpec;
use swath_agents::runner::run_summary;
use swath_core::config::Document;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let agent: AgentSpec = args[0].parse().unwrap();
    let instances: u64 = args[1].parse().unwrap();
    let counts: Vec<u32> = args[2].split(',').map(|n| n.parse().unwrap()).collect();
    let extra = args.get(3).cloned().unwrap_or_default().replace(';', "\n");
    let base = args.get(4).cloned().unwrap_or("pasture".into());
    for n in counts {
        let mut doc = Document::open(&base).unwrap();
        doc.overlay(format!("weeds.count = {n}\n{extra}").parse().unwrap());
        let scenario = doc.scenario().unwrap();
        let (mut pct, mut sq, mut m, mut mowed, mut worst, mut unseen, mut secs) =
            (0.0, 0.0, 0.0, 0.0, 1.0_f64, 0.0, 0.0);
        let mut outcomes = std::collections::BTreeMap::new();
        for seed in 0..instances {
            let t = Instant::now();
            let (s, o) = run_summary(&scenario, &agent, seed);
            secs += t.elapsed().as_secs_f64();
            let p = 100.0 * s.path_length_m / s.bcp_length_m;
            pct += p;
            sq += p * p;
            m += s.path_length_m;
            let f = s.weeds_mowed as f64 / s.weeds_total as f64;
            mowed += f;
            worst = worst.min(f);
            unseen += 1.0 - s.seen_fraction;
            *outcomes.entry(format!("{o:?}")).or_insert(0) += 1;
        }
        let k = instances as f64;
        let (mean, sd) = (pct / k, (sq / k - (pct / k) * (pct / k)).max(0.0).sqrt());
        println!(
            "{n:4}: {mean:6.2} +- {:4.2} %  {:6.1} m  mowed {:7.3} worst {:7.3}  unseen {:.4} %  {:6.3} s/episode {outcomes:?}",
            sd / k.sqrt(),
            m / k,
            100.0 * mowed / k,
            100.0 * worst,
            100.0 * unseen / k,
            secs / k
        );
    }
}
