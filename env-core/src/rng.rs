//! Random numbers: one stream per purpose, all from one seed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::math;

/// What a stream of random numbers is for. Numbers are never reused or reordered: that would redraw every pasture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Where the weeds stand.
    Weeds = 0,
}

/// The generator of a stream.
pub type StreamRng = ChaCha8Rng;

/// Tells an agent's numbers apart from the environment's: "agent" in ASCII.
const AGENT_SALT: u64 = 0x61_67_65_6e_74;

/// The generator of one purpose. A draw from one stream never shifts another.
#[must_use]
pub fn stream(seed: u64, purpose: Stream) -> StreamRng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(purpose as u64);
    rng
}

/// The generator of an agent's own choices, hashed apart from every environment stream, so that an agent built with the
/// environment's seed cannot redraw the weeds.
#[must_use]
pub fn agent_rng(seed: u64) -> StreamRng {
    ChaCha8Rng::seed_from_u64(scramble(seed ^ scramble(AGENT_SALT)))
}

/// Seed of episode number `episode` of an environment seeded `seed`; episode 0 has the environment's own seed.
#[must_use]
pub fn episode_seed(seed: u64, episode: u64) -> u64 {
    if episode == 0 { seed } else { scramble(seed ^ scramble(episode)) }
}

/// `SplitMix64`'s output function (Steele, Lea & Flood, 2014): a bijection without visible structure.
fn scramble(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1).
pub fn uniform(rng: &mut StreamRng) -> f64 {
    rng.random::<f64>()
}

/// Sixty-four random bits.
pub fn bits(rng: &mut StreamRng) -> u64 {
    rng.random::<u64>()
}

/// A whole number in 0..`count`.
pub fn below(count: usize, rng: &mut StreamRng) -> usize {
    rng.random_range(0..count)
}

/// Two independent standard normal numbers, by the transform of Box & Muller (1958).
///
/// Written out because library samplers call the system's `exp` and `ln`, whose last bit differs between machines.
pub fn normal_pair(rng: &mut StreamRng) -> (f64, f64) {
    let radius = (-2.0 * math::ln(1.0 - uniform(rng))).sqrt();
    let (sin, cos) = math::sin_cos(std::f64::consts::TAU * uniform(rng));
    (radius * cos, radius * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_episode_has_the_seed_of_its_environment() {
        assert_eq!(episode_seed(7, 0), 7);
        assert_ne!(episode_seed(7, 1), episode_seed(8, 1));
        assert_ne!(episode_seed(7, 1), episode_seed(7, 2));
    }

    #[test]
    fn an_agents_numbers_differ_from_those_of_its_environment() {
        let mut agent = agent_rng(7);
        let mut weeds = stream(7, Stream::Weeds);
        assert_ne!(agent.random::<u64>(), weeds.random::<u64>());
    }

    #[test]
    fn normal_numbers_have_mean_zero_and_variance_one() {
        let mut rng = stream(1, Stream::Weeds);
        let draws: Vec<f64> =
            (0..20_000).map(|_| normal_pair(&mut rng)).flat_map(|(a, b)| [a, b]).collect();
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        let variance = draws.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / n;
        // Five standard errors: 5 / sqrt(40000) = 0.025, and sqrt(2) times that for the variance.
        assert!(mean.abs() < 0.025 && (variance - 1.0).abs() < 0.036, "{mean} {variance}");
    }
}
