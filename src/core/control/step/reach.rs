//! How far a foot of `catch` is aimed, beyond its [landing region](LandingRegion), and how long it is in the air, by its
//! travel. The pendulum bound `early` of `standfast limit` rests on the same footsteps, but for a foot that goes back after a
//! crossing: there it goes straight. With the fixed time that `catch` gives it, the bound of UT-mu2 would be 2 % larger on the
//! diagonals.

use super::swing::EARLIEST_LANDING;
use crate::lipm::capture::Place;
use crate::robot::LandingRegion;
use nalgebra::Vector2;

/// Factors on the reach of a foot that goes straight: forward and backward, and to the side from home. A landing region
/// ends where soles stay flat and its time suffices. But a sole rolls onto its edge where an ankle is at its limit, and a
/// farther way takes longer by `TRAVEL_SHARE`. To the side, this time is what bounds a footstep, hardly the reach.
const BEYOND: [f64; 2] = [1.25, 3.0];
/// Swing time of a foot that goes straight, in swing times of its landing region: without travel, and per travel of one
/// COM height. The time of a region is that of its farthest place from home.
const STILL_SHARE: f64 = 0.7;
const TRAVEL_SHARE: f64 = 0.5;
/// Number of places along a side of a region of straight footsteps, and along the sides of one in which legs cross.
const PLACES: [[usize; 2]; 2] = [[11, 11], [2, 6]];

/// Smallest and largest x and y at which a foot is aimed (m, axes of the stance sole with y to the side of the foot), for feet
/// that are `width_m` apart at home.
pub fn aimed_m(region: &LandingRegion, width_m: f64) -> [[f64; 2]; 2] {
    let [x, [inward, outward]] = [region.x_m, region.y_m];
    if region.crosses() {
        return [x, [inward, outward]];
    }
    let beyond = width_m + BEYOND[1] * (outward - width_m);
    [x.map(|x| BEYOND[0] * x), [inward, beyond]]
}

/// Planned time (s) of a foot that goes straight to a region of the time `region_s`, over a `travel` in COM heights.
pub fn time_s(region_s: f64, travel: f64) -> f64 {
    region_s * (STILL_SHARE + TRAVEL_SHARE * travel)
}

/// A grid of the places at which a foot is aimed, with the times from which on a landing there counts. The feet are `width_m`
/// apart at home, and the COM is `length_m` high.
pub fn earliest(reach: &[LandingRegion], width_m: f64, length_m: f64) -> Vec<Place> {
    let of_region = |region: &LandingRegion| {
        let soonest_s = EARLIEST_LANDING * region.swing_time_s;
        let time_s = if region.crosses() {
            [soonest_s, 0.0]
        } else {
            let still_s = time_s(soonest_s, 0.0);
            [still_s, (time_s(soonest_s, 1.0) - still_s) / length_m]
        };
        let [along, beside] = PLACES[usize::from(region.crosses())];
        let [x, y] = aimed_m(region, width_m);
        let at = |[low, high]: [f64; 2], i: usize, count: usize| {
            low + (high - low) * i as f64 / (count - 1) as f64
        };
        (0..along * beside).map(move |i| Place {
            at: Vector2::new(at(x, i % along, along), at(y, i / along, beside)),
            time_s,
        })
    };
    reach.iter().flat_map(of_region).collect()
}
