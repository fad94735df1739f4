//! Views, laid open for comparison.

use swath_core::geometry::Pose;
use swath_core::site::Site;
use swath_core::view::View;

/// Everything that a view holds, with every number as its bits.
///
/// Taken apart field by field: a field that is added to the view or to the site has to be judged here before this compiles.
#[derive(Debug, PartialEq)]
pub struct Sight {
    site: Vec<u64>,
    mower: Vec<u64>,
    known_weeds: Vec<(u32, u64, u64)>,
    weeds_mowed: Vec<u32>,
    weeds_detected: u32,
    unseen: Vec<(usize, usize)>,
}

/// What a view holds.
#[must_use]
pub fn sight(view: &View) -> Sight {
    let View { site, pose, direction, path_m, known_weeds, weeds_detected, ground } = *view;
    let Site {
        length_m,
        width_m,
        headland_m,
        deck_width_m,
        turning_radius_m,
        speed_mps,
        sensor_range_m,
        sensor_width_m,
        control_distance_m,
        bcp_length_m,
    } = *site;
    let Pose { x_m, y_m, heading_rad } = pose;
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect();
    let grid = ground.grid();
    // Which of two weeds under the bar was mowed first is no part of what is known.
    let mut weeds_mowed = known_weeds.removed().to_vec();
    weeds_mowed.sort_unstable();
    Sight {
        site: bits(&[
            length_m,
            width_m,
            headland_m,
            deck_width_m,
            turning_radius_m,
            speed_mps,
            sensor_range_m,
            sensor_width_m,
            control_distance_m,
            bcp_length_m,
        ]),
        mower: bits(&[x_m, y_m, heading_rad, direction.0, direction.1, path_m]),
        known_weeds: known_weeds
            .iter()
            .map(|weed| (weed.number, weed.position.x.to_bits(), weed.position.y.to_bits()))
            .collect(),
        weeds_mowed,
        weeds_detected,
        unseen: (0..grid.rows())
            .flat_map(|row| (0..grid.columns()).map(move |column| (column, row)))
            .filter(|&(column, row)| !ground.is_seen(column, row))
            .collect(),
    }
}
