//! Catching footsteps.
use super::relaxation::in_box;
use crate::error::Result;
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catching {
    pub forward_m: f64,
    pub outward_m: f64,
    pub inward_m: f64,
    pub swing_time_s: f64,
    pub lift_m: f64,
    pub late_s: f64,
    pub pause_s: f64,
    pub patience_s: f64,
    pub outside_m: f64,
    pub transfer_s: f64,
    pub settle_s: f64,
    pub zmp_weight: f64,
    pub place_weight: f64,
    pub most_miss_m: f64,
    pub margin_m: f64,
    pub overshoot: f64,
    pub delay_s: f64,
    pub forgetting: f64,
}

impl Catching {
    pub fn validate(&self, _file: &str) -> Result<()> {
        Ok(())
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Catch {
    /// Stance sole frame, y to the side of the swing foot.
    pub zmp: Vector2<f64>,
    pub place: Vector2<f64>,
    pub dcm: Vector2<f64>,
    pub miss: f64,
    pub cost: f64,
}

/// `dcm` in stance sole frame with y to the side of the swing foot. `fixed`: landing place decided.
pub fn plan(
    rules: &Catching,
    omega: f64,
    time_s: f64,
    dcm: Vector2<f64>,
    half: [f64; 2],
    home: Vector2<f64>,
    fixed: Option<Vector2<f64>>,
) -> Catch {
    let e = (omega * time_s).exp();
    let mut best: Option<Catch> = None;
    for share in [0.5, 0.6, 0.7, 0.8, 0.9, 1.0] {
        let mut c = Catch { zmp: Vector2::zeros(), place: home, dcm, miss: 0.0, cost: rules.overshoot * (share - 0.5) * (share - 0.5) };
        let mut miss = Vector2::zeros();
        for k in 0..2 {
            let [lo, hi] = if k == 0 { [-rules.forward_m, rules.forward_m] } else { [rules.inward_m, rules.outward_m] };
            let [lo, hi] = fixed.map_or([lo, hi], |f| [f[k], f[k]]);
            let z = (half[k] - rules.margin_m).max(0.0);
            // r = e dcm + (1 - e) p - share f
            let row = Vector2::new(1.0 - e, -share);
            let h = row * row.transpose() + Matrix2::new(rules.zmp_weight, 0.0, 0.0, rules.place_weight);
            let a = e * dcm[k];
            let l = -row * a + Vector2::new(0.0, rules.place_weight * home[k]);
            let x = in_box(&h, &l, [[-z, z], [lo, hi]]);
            c.zmp[k] = x[0];
            c.place[k] = x[1];
            c.dcm[k] = a + (1.0 - e) * x[0];
            let r = c.dcm[k] - share * x[1];
            miss[k] = (r.abs() - half[k]).max(0.0);
            c.cost += r * r + rules.zmp_weight * x[0] * x[0] + rules.place_weight * (x[1] - home[k]).powi(2);
        }
        c.miss = miss.norm();
        c.cost += 100.0 * c.miss;
        if best.is_none_or(|b| c.cost < b.cost) {
            best = Some(c);
        }
    }
    best.expect("one")
}
