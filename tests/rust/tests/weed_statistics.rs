//! Weeds are spread as they should be: evenly, or normally around seeds that are spread evenly. Every statistic lies within
//! five of its standard errors, which a fair draw misses once in two million.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use swath_core::config::{Distribution, Scenario};
use swath_core::env::Env;
use swath_core::geometry::Point;

const STANDARD_ERRORS: f64 = 5.0;

fn scenario(length_m: f64, width_m: f64, count: u32, distribution: Distribution) -> Scenario {
    let mut scenario = Scenario::default();
    scenario.pasture.length_m = length_m;
    scenario.pasture.width_m = width_m;
    scenario.weeds.count = count;
    scenario.weeds.distribution = distribution;
    scenario
}

fn weeds_of(scenario: &Scenario, seed: u64) -> Vec<Point> {
    let mut env = Env::new(&scenario.clone().check().unwrap());
    env.reset(seed);
    env.weeds().positions().to_vec()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean product of the deviations from two centres.
fn covariance(a: &[f64], a_centre: f64, b: &[f64], b_centre: f64) -> f64 {
    let products = a.iter().zip(b).map(|(a, b)| (a - a_centre) * (b - b_centre));
    products.sum::<f64>() / a.len() as f64
}

fn is_near(value: f64, expected: f64, standard_error: f64) -> bool {
    (value - expected).abs() < STANDARD_ERRORS * standard_error
}

/// Of n even draws from 0..1 the mean errs by 1 / sqrt(12 n), the mean square deviation from 1/2 by 1 / sqrt(180 n), the
/// covariance by 1 / (12 sqrt(n)).
fn assert_even(xs: &[f64], ys: &[f64], what: &str) {
    let n = xs.len() as f64;
    for (axis, values) in [("x", xs), ("y", ys)] {
        assert!(is_near(mean(values), 0.5, 1.0 / (12.0 * n).sqrt()), "{what}: mean of {axis}");
        let variance = covariance(values, 0.5, values, 0.5);
        assert!(
            is_near(variance, 1.0 / 12.0, 1.0 / (180.0 * n).sqrt()),
            "{what}: variance of {axis} is {variance}"
        );
        for tenth in 0..10 {
            let from = f64::from(tenth) / 10.0;
            let count = values.iter().filter(|v| (from..from + 0.1).contains(*v)).count();
            let error = (0.09 * n).sqrt();
            assert!(is_near(count as f64, 0.1 * n, error), "{what}: {count} {axis} from {from}");
        }
    }
    let both = covariance(xs, 0.5, ys, 0.5);
    assert!(is_near(both, 0.0, 1.0 / (12.0 * n.sqrt())), "{what}: x and y go together by {both}");
}

#[test]
fn uniform_weeds_are_spread_evenly() {
    let weeds = weeds_of(&scenario(100.0, 40.0, 40_000, Distribution::Uniform), 11);
    let xs: Vec<f64> = weeds.iter().map(|weed| weed.x / 100.0).collect();
    let ys: Vec<f64> = weeds.iter().map(|weed| weed.y / 40.0).collect();
    assert_even(&xs, &ys, "one draw of 40 000");
}

/// Instance after instance, not only within one.
#[test]
fn the_first_weed_of_many_seeds_is_spread_evenly() {
    let scenario = scenario(100.0, 40.0, 1, Distribution::Uniform);
    let weeds: Vec<Point> = (0..20_000).map(|seed| weeds_of(&scenario, seed)[0]).collect();
    let xs: Vec<f64> = weeds.iter().map(|weed| weed.x / 100.0).collect();
    let ys: Vec<f64> = weeds.iter().map(|weed| weed.y / 40.0).collect();
    assert_even(&xs, &ys, "the first of 20 000 seeds");
}

/// Around a single seed, far from the borders, so that none is drawn again: n normal draws have a mean that errs by
/// sigma / sqrt(n), a variance that errs by sigma^2 sqrt(2 / n), a covariance that errs by sigma^2 / sqrt(n).
#[test]
fn gaussian_weeds_are_spread_normally_around_their_seed() {
    let sigma_m = 3.0;
    let mut scenario = scenario(400.0, 300.0, 20_001, Distribution::Gaussian);
    scenario.weeds.sigma_m = sigma_m;
    scenario.weeds.cluster_fraction = 0.0;
    let is_far_from_borders =
        |seed: &Point| (30.0..370.0).contains(&seed.x) && (30.0..270.0).contains(&seed.y);
    let weeds = (0..100)
        .map(|seed| weeds_of(&scenario, seed))
        .find(|weeds| is_far_from_borders(&weeds[0]))
        .expect("most seeds stand far from the borders");
    let dxs: Vec<f64> = weeds[1..].iter().map(|weed| weed.x - weeds[0].x).collect();
    let dys: Vec<f64> = weeds[1..].iter().map(|weed| weed.y - weeds[0].y).collect();
    let n = dxs.len() as f64;
    for (axis, values) in [("x", &dxs), ("y", &dys)] {
        assert!(is_near(mean(values), 0.0, sigma_m / n.sqrt()), "mean of {axis}");
        let variance = covariance(values, 0.0, values, 0.0);
        let error = sigma_m * sigma_m * (2.0 / n).sqrt();
        assert!(is_near(variance, sigma_m * sigma_m, error), "variance of {axis} is {variance}");
        // The shares within one and two sigma of a normal distribution, which a uniform one of that spread misses.
        for (sigmas, share) in [(1.0, 0.682_689), (2.0, 0.954_500)] {
            let within = values.iter().filter(|v| v.abs() < sigmas * sigma_m).count() as f64;
            let error = (n * share * (1.0 - share)).sqrt();
            assert!(is_near(within, n * share, error), "{within} {axis} within {sigmas} sigma");
        }
    }
    let both = covariance(&dxs, 0.0, &dys, 0.0);
    assert!(is_near(both, 0.0, sigma_m * sigma_m / n.sqrt()), "x and y go together by {both}");
}

/// Of 40 weeds round(0.2 x 40) = 8 are seeds, drawn evenly and first; with a spread of a millimetre every other weed shows
/// which seed it picked, each of them as often as any other.
#[test]
fn the_first_fifth_are_seeds_spread_evenly_and_picked_evenly() {
    let (count, seeds, episodes) = (40, 8, 2_000);
    let mut scenario = scenario(100.0, 40.0, count, Distribution::Gaussian);
    scenario.weeds.sigma_m = 1e-3;
    let (mut xs, mut ys, mut picked) = (Vec::new(), Vec::new(), [0_u32; 8]);
    for episode in 0..episodes {
        let weeds = weeds_of(&scenario, episode);
        let (first, rest) = weeds.split_at(seeds);
        xs.extend(first.iter().map(|weed| weed.x / 100.0));
        ys.extend(first.iter().map(|weed| weed.y / 40.0));
        for weed in rest {
            let near = |seed: &Point| (seed - weed).norm() < 0.01;
            // Two seeds within a centimetre of each other would be an accident of one in a million.
            picked[first.iter().position(near).expect("every weed stands at a seed")] += 1;
        }
    }
    assert_even(&xs, &ys, "seeds");
    let n = f64::from(picked.iter().sum::<u32>());
    assert!((n - 2_000.0 * 32.0).abs() < 0.5);
    for (seed, &times) in picked.iter().enumerate() {
        let error = (n / 8.0 * (7.0 / 8.0)).sqrt();
        assert!(is_near(f64::from(times), n / 8.0, error), "seed {seed} picked {times} times");
    }
}

/// The number of seeds is round(fraction x count), at least one and at most all.
#[test]
fn as_many_weeds_are_seeds_as_the_fraction_says() {
    for (count, fraction, seeds) in [
        (20, 0.2, 4),
        (14, 0.2, 3),
        (12, 0.2, 2),
        (2, 0.2, 1),
        (40, 0.0, 1),
        (10, 1.0, 10),
        (7, 0.5, 4),
    ] {
        let mut clustered = scenario(100.0, 40.0, count, Distribution::Gaussian);
        clustered.weeds.cluster_fraction = fraction;
        clustered.weeds.sigma_m = 1e-6;
        for seed in 0..20 {
            let weeds = weeds_of(&clustered, seed);
            let is_seed = |&number: &usize| {
                weeds[..number].iter().all(|other| (other - weeds[number]).norm() > 1e-3)
            };
            let found: Vec<usize> = (0..weeds.len()).filter(is_seed).collect();
            assert_eq!(found, (0..seeds).collect::<Vec<_>>(), "{count} weeds, fraction {fraction}");
        }
    }
}

/// Weeds that would fall beside the pasture are drawn again, not clamped: none stands exactly on a border.
#[test]
fn no_weed_is_pushed_onto_the_border() {
    let mut clustered = scenario(20.0, 10.0, 2_000, Distribution::Gaussian);
    clustered.weeds.sigma_m = 15.0;
    let weeds = weeds_of(&clustered, 3);
    let is_on_border = |weed: &&Point| {
        [weed.x, 20.0 - weed.x, weed.y, 10.0 - weed.y].iter().any(|gap_m| *gap_m < 1e-9)
    };
    assert_eq!(weeds.iter().filter(is_on_border).count(), 0);
}
