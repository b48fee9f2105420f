//! Impulses by heading, seen from above: forward is up, left is to the left, and the impulse grows from the middle
//! outward.

use super::panel::{Panel, PanelPoint, PanelView, short};

/// Space around the outermost ring for names (px).
const MARGIN: f64 = 30.0;
/// Heading at which the rings have their numbers (degrees), between the headings that are tried.
const NUMBERS_DEG: f64 = -11.25;

/// A panel whose places are impulses (N s; forward, to the left). Its origin in px is in the middle, too.
pub struct Polar {
    pub panel: Panel,
    most_n_s: f64,
    /// Radius of the outermost ring (px).
    radius: f64,
}

/// Place of an impulse with a heading (N s; forward, to the left).
pub fn towards(heading_deg: f64, impulse_n_s: f64) -> PanelPoint {
    let (sin, cos) = heading_deg.to_radians().sin_cos();
    [impulse_n_s * cos, impulse_n_s * sin]
}

impl Polar {
    pub fn new(radius: f64, most_n_s: f64) -> Self {
        let half = radius + MARGIN;
        let mut panel = Panel::new(2.0 * half, 2.0 * half);
        (panel.corner, panel.view) = (
            [-half, -half],
            PanelView::from_above([0.0, 0.0], radius / most_n_s),
        );
        Self {
            panel,
            most_n_s,
            radius,
        }
    }

    /// Distance of an impulse from the middle (px).
    pub fn length(&self, impulse_n_s: f64) -> f64 {
        self.radius * impulse_n_s / self.most_n_s
    }

    /// Draws rings at impulses (N s), and lines fore and aft and to both sides.
    pub fn rings(&mut self, rings_n_s: &[f64]) {
        for impulse_n_s in rings_n_s.iter().filter(|ring| **ring > 0.0) {
            let radius = self.length(*impulse_n_s);
            self.panel.circle("grid", [0.0, 0.0], radius);
        }
        for heading_deg in [0.0, 90.0] {
            let ends = [heading_deg, heading_deg + 180.0].map(|deg| towards(deg, self.most_n_s));
            self.panel.line("grid", ends[0], ends[1]);
        }
    }

    /// Writes the names of the directions and the numbers of the rings, over everything else.
    pub fn names(&mut self, rings_n_s: &[f64]) {
        let beyond = self.radius + 10.0;
        // At most six rings have a number.
        let every = rings_n_s.len().div_ceil(6);
        let numbered = rings_n_s
            .iter()
            .rev()
            .step_by(every)
            .filter(|ring| **ring > 0.0);
        for (i, impulse_n_s) in numbered.enumerate() {
            let unit = if i == 0 { " N\u{a0}s" } else { "" };
            let number = format!("{}{unit}", short(*impulse_n_s, 2));
            self.panel.text(
                "ring halo",
                towards(NUMBERS_DEG, *impulse_n_s),
                [0.0, 4.0],
                &number,
            );
        }
        self.panel.in_px(|panel| {
            panel.text("name", [0.0, -beyond], [0.0, 0.0], "forward, 0\u{b0}");
            panel.text("name", [0.0, beyond], [0.0, 11.0], "backward, 180\u{b0}");
            panel.turned_text("name", [-beyond, 0.0], -90.0, "left, 90\u{b0}");
            panel.turned_text("name", [beyond, 0.0], 90.0, "right, \u{2212}90\u{b0}");
        });
    }
}
