//! Maps of trials by heading and impulse, seen from above: forward is up, left is to the left, the impulse grows from
//! the middle outward.

use super::svg::{escape, px, short};
use super::trials::Trials;
use crate::campaign::TrialRow;
use crate::episode::Outcome;
use std::fmt::Write;

/// Of the outermost ring, in units of the picture (320 by 320, the middle at 0, 0); the script knows it too.
const RADIUS: f64 = 130.0;
/// Fewer trials than this make a pale cell.
const FEW: u32 = 5;
/// With so many trials sectors are half as wide.
const NARROW_SECTORS: usize = 400;
/// More trials than this have small marks.
const MANY: usize = 300;
/// Half the length of the arms of a cross.
const CROSS: f64 = 2.2;
const SMALL_CROSS: f64 = 1.5;
/// Steps of colour from none recovered to all.
const SHADES: f64 = 10.0;

/// Maps of one campaign: all with the same rings and sectors.
pub(super) struct Maps<'a> {
    trials: &'a Trials<'a>,
    /// Impulses (N s) at which rings begin and end.
    edges_n_s: Vec<f64>,
    sectors: usize,
}

impl<'a> Maps<'a> {
    /// `edges_n_s` ascend, and hold all impulses.
    pub fn new(edges_n_s: Vec<f64>, trials: &'a Trials<'a>) -> Self {
        let sectors = if trials.len() >= NARROW_SECTORS { 16 } else { 8 };
        Self { trials, edges_n_s, sectors }
    }

    /// Count of rings.
    fn rings(&self) -> usize {
        self.edges_n_s.len() - 1
    }

    fn most_n_s(&self) -> f64 {
        *self.edges_n_s.last().unwrap_or(&1.0)
    }

    /// Share of recovered trials of one set, and its trials.
    pub fn set(&self, set: usize) -> String {
        let mut svg = self.opened(&format!("Success of {} by heading and impulse", self.trials.sets[set]), set, set);
        self.cells(&mut svg, set);
        self.rings_and_axes(&mut svg);
        if self.trials.as_dots() {
            let won = |trial: &&[TrialRow]| trial[set].outcome == Outcome::Recovered;
            svg += &self.dots("won", won);
            svg += &self.crosses("lost", |trial| !won(trial));
        }
        self.names(&mut svg);
        svg + "</svg>"
    }

    /// The trials in which two sets differ. None: too many trials for dots.
    pub fn pair(&self, a: usize, b: usize) -> Option<String> {
        if !self.trials.as_dots() {
            return None;
        }
        let names = self.trials.sets;
        let mut svg = self.opened(&format!("Trials that only one of {} and {} recovered", names[a], names[b]), a, b);
        self.rings_and_axes(&mut svg);
        let won = |row: &TrialRow| row.outcome == Outcome::Recovered;
        svg += &self.dots("same", |trial| won(&trial[a]) == won(&trial[b]));
        for (only, other) in [(a, b), (b, a)] {
            let class = format!("only s{}", only % super::svg::colors());
            let differ = |trial: &&[TrialRow]| won(&trial[only]) && !won(&trial[other]);
            svg += &self.dots(&if only == a { class } else { format!("{class} square") }, differ);
        }
        self.names(&mut svg);
        Some(svg + "</svg>")
    }

    /// A picture whose dots the script finds: the impulse at its edge, and the sets whose trials it replays.
    fn opened(&self, label: &str, a: usize, b: usize) -> String {
        let most = self.most_n_s();
        let many = if self.trials.len() > MANY { " many" } else { "" };
        let sets = if a == b { a.to_string() } else { format!("{a} {b}") };
        format!(
            "<svg class=\"map{many}\" viewBox=\"-160 -160 320 320\" role=\"img\" aria-label=\"{}\" \
             data-most=\"{most}\" data-sets=\"{sets}\">",
            escape(label)
        )
    }

    fn cells(&self, svg: &mut String, set: usize) {
        let width_deg = 360.0 / self.sectors as f64;
        let mut counts = vec![(0u32, 0u32); self.sectors * self.rings()];
        for row in self.trials.iter().map(|trial| &trial[set]) {
            let sector = ((row.heading_deg.rem_euclid(360.0) / width_deg).round() as usize) % self.sectors;
            let ring = self.edges_n_s[1..].partition_point(|edge| *edge <= row.impulse_n_s).min(self.rings() - 1);
            let count = &mut counts[ring * self.sectors + sector];
            count.0 += u32::from(row.outcome == Outcome::Recovered);
            count.1 += 1;
        }
        for (i, (recovered, trials)) in counts.into_iter().enumerate().filter(|(_, (_, trials))| *trials > 0) {
            let (ring, sector) = (i / self.sectors, i % self.sectors);
            let (inner, outer) = (self.edges_n_s[ring], self.edges_n_s[ring + 1]);
            let heading_deg = sector as f64 * width_deg;
            let (from, to) = (heading_deg - width_deg / 2.0, heading_deg + width_deg / 2.0);
            let rate = f64::from(recovered) / f64::from(trials);
            let pale = if trials < FEW { " pale" } else { "" };
            // Writing to a String cannot fail.
            _ = write!(
                svg,
                "<path class=\"r{}{pale}\" d=\"{}\"><title>{} to {} N s, heading {}\u{b0}: {recovered} of {trials} \
                 recovered ({:.0} %)</title></path>",
                (rate * SHADES).round(),
                self.ring_part(inner, outer, from, to),
                short(inner, 3),
                short(outer, 3),
                short(if heading_deg > 180.0 { heading_deg - 360.0 } else { heading_deg }, 1),
                100.0 * rate
            );
        }
    }

    /// Outline of a part of a ring, headings in degrees.
    fn ring_part(&self, inner: f64, outer: f64, from: f64, to: f64) -> String {
        let place = |impulse, heading| {
            let (x, y) = self.at(impulse, heading);
            format!("{} {}", px(x), px(y))
        };
        let (small, large) = (px(self.length(inner)), px(self.length(outer)));
        format!(
            "M{}L{}A{large} {large} 0 0 0 {}L{}A{small} {small} 0 0 1 {}z",
            place(inner, from),
            place(outer, from),
            place(outer, to),
            place(inner, to),
            place(inner, from)
        )
    }

    fn rings_and_axes(&self, svg: &mut String) {
        *svg += "<g class=\"frame\">";
        for edge in self.edges_n_s.iter().filter(|edge| **edge > 0.0) {
            _ = write!(svg, "<circle r=\"{}\"/>", px(self.length(*edge)));
        }
        _ = write!(svg, "<path d=\"M0-{RADIUS}V{RADIUS}M-{RADIUS} 0H{RADIUS}\"/></g>");
    }

    /// Names of axes and rings, over all else.
    fn names(&self, svg: &mut String) {
        *svg += "<g class=\"names\">";
        for (x, y, name) in [(0, -140, "forward, 0\u{b0}"), (0, 151, "backward, 180\u{b0}")] {
            _ = write!(svg, "<text x=\"{x}\" y=\"{y}\">{name}</text>");
        }
        for (x, turn, name) in [(-140, -90, "left, 90\u{b0}"), (140, 90, "right, \u{2212}90\u{b0}")] {
            _ = write!(svg, "<text transform=\"translate({x} 0)rotate({turn})\">{name}</text>");
        }
        // Every ring of a few, every other of many, each where it ends.
        let every = self.rings().div_ceil(4);
        let labelled = self.edges_n_s.iter().rev().step_by(every).filter(|edge| **edge > 0.0);
        for (i, edge) in labelled.enumerate() {
            let unit = if i == 0 { " N\u{a0}s" } else { "" };
            let y = px(3.5 - self.length(*edge));
            _ = write!(svg, "<text class=\"ring\" y=\"{y}\">{}{unit}</text>", short(*edge, 2));
        }
        *svg += "</g>";
    }

    /// Lines of no length, whose ends the style sheet shapes.
    fn dots(&self, class: &str, chosen: impl Fn(&&[TrialRow]) -> bool) -> String {
        self.marks(class, chosen, |path, x, y| _ = write!(path, "M{} {}h0", px(x), px(y)))
    }

    fn crosses(&self, class: &str, chosen: impl Fn(&&[TrialRow]) -> bool) -> String {
        let arm = if self.trials.len() > MANY { SMALL_CROSS } else { CROSS };
        let (arm, across) = (px(arm), px(2.0 * arm));
        self.marks(class, chosen, |path, x, y| {
            _ = write!(path, "M{} {}m-{arm}-{arm}l{across} {across}m0-{across}l-{across} {across}", px(x), px(y));
        })
    }

    fn marks(
        &self,
        class: &str,
        chosen: impl Fn(&&[TrialRow]) -> bool,
        mark: impl Fn(&mut String, f64, f64),
    ) -> String {
        let mut path = String::new();
        for trial in self.trials.iter().filter(chosen) {
            let (x, y) = self.at(trial[0].impulse_n_s, trial[0].heading_deg);
            mark(&mut path, x, y);
        }
        format!("<path class=\"{class}\" d=\"{path}\"/>")
    }

    fn length(&self, impulse_n_s: f64) -> f64 {
        RADIUS * impulse_n_s / self.most_n_s()
    }

    /// Place in the picture: y points down.
    fn at(&self, impulse_n_s: f64, heading_deg: f64) -> (f64, f64) {
        let (sin, cos) = heading_deg.to_radians().sin_cos();
        let length = self.length(impulse_n_s);
        (-length * sin, -length * cos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::row::tests::row;

    /// Forward is up and left is to the left; a heading of a full turn is the same place.
    #[test]
    fn headings_are_seen_from_above() {
        let sets = ["hold"];
        let turned = |trial, heading_deg| TrialRow { heading_deg, ..row(trial, "hold", 2.0, Outcome::Recovered) };
        let rows = [
            turned(0, 0.0),
            turned(1, 90.0),
            turned(2, -270.0),
            TrialRow { outcome: Outcome::Fell, ..turned(3, 91.0) },
        ];
        let trials = Trials { sets: &sets, rows: &rows };
        let maps = Maps::new(vec![0.0, 1.0, 2.0], &trials);
        let ((x, y), (left, level)) = (maps.at(2.0, 0.0), maps.at(2.0, 90.0));
        assert!(x.abs() < 1e-9 && y == -RADIUS && left == -RADIUS && level.abs() < 1e-9);
        let svg = maps.set(0);
        assert!(svg.contains("heading 90\u{b0}: 2 of 3 recovered (67 %)"), "{svg}");
        assert!(svg.contains("heading 0\u{b0}: 1 of 1 recovered (100 %)"), "{svg}");
    }
}
