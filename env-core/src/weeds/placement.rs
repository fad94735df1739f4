//! Where weeds grow.

use crate::config::{Distribution, PastureConfig, WeedsConfig};
use crate::geometry::Point;
use crate::math::floor_index;
use crate::rng::{StreamRng, below, normal_pair, uniform};

/// Writes the weeds of one episode to `weeds`: those of the scenario if it gives them, else a draw.
///
/// Maini, Gonultas & Isler (2022), section VII-A: uniform, or 20 % of the weeds as seeds of Gaussian clusters for the rest.
/// Deviations, where the paper is silent: seeds are weeds themselves; each further weed picks a seed evenly and is drawn
/// again until it falls on the pasture; the spread is the scenario's `sigma_m`.
pub fn draw(
    config: &WeedsConfig,
    pasture: &PastureConfig,
    weeds: &mut Vec<Point>,
    rng: &mut StreamRng,
) {
    weeds.clear();
    if let Some(positions_m) = &config.positions_m {
        weeds.extend(positions_m.iter().map(|&[x_m, y_m]| Point::new(x_m, y_m)));
        return;
    }
    let count = config.count as usize;
    let drawn_evenly = match config.distribution {
        Distribution::Uniform => count,
        Distribution::Gaussian => {
            floor_index((config.cluster_fraction * count as f64).round()).max(1).min(count)
        }
    };
    for _ in 0..drawn_evenly {
        let x_m = uniform(rng) * pasture.length_m;
        weeds.push(Point::new(x_m, uniform(rng) * pasture.width_m));
    }
    while weeds.len() < count {
        let seed = weeds[below(drawn_evenly, rng)];
        let (dx, dy) = normal_pair(rng);
        let weed = Point::new(seed.x + config.sigma_m * dx, seed.y + config.sigma_m * dy);
        if (0.0..=pasture.length_m).contains(&weed.x) && (0.0..=pasture.width_m).contains(&weed.y) {
            weeds.push(weed);
        }
    }
}
