//! Maps of trials by heading and impulse, seen from above: forward is up, left is to the left, and the impulse grows
//! from the middle outward.

use super::trials::Trials;
use crate::figure::COLORS;
use crate::figure::panel::{PanelPoint, escape, px, short};
use crate::figure::polar::{Polar, towards};

/// Radius of the outermost ring in units of the picture, which is 320 by 320 with 0, 0 in the middle. The script of the
/// page uses the same number.
const RADIUS: f64 = 130.0;
/// Least number of trials of a cell that is not pale.
const FEW: u32 = 5;
/// Number of trials from which on sectors are half as wide.
const NARROW_SECTORS: usize = 400;
/// Largest number of trials with marks of full size. With more, marks are small.
const MANY: usize = 300;
/// Half the width of a cross, and of a small one, in units of the picture.
const CROSS: f64 = 2.2;
const SMALL_CROSS: f64 = 1.5;
/// Number of steps of colour from no recovered trial to all.
const SHADES: f64 = 10.0;

/// Maps of one campaign, all with the same rings and sectors.
pub(super) struct Maps<'a> {
    trials: &'a Trials<'a>,
    /// Impulses at the edges of the rings (N s), in ascending order.
    edges_n_s: Vec<f64>,
    sectors: usize,
}

impl<'a> Maps<'a> {
    /// `edges_n_s` are in ascending order, and all impulses lie between them.
    pub fn new(edges_n_s: Vec<f64>, trials: &'a Trials<'a>) -> Self {
        let sectors = if trials.len() >= NARROW_SECTORS {
            16
        } else {
            8
        };
        Self {
            trials,
            edges_n_s,
            sectors,
        }
    }

    fn rings(&self) -> usize {
        self.edges_n_s.len() - 1
    }

    /// Impulse at the outermost ring (N s).
    fn most_n_s(&self) -> f64 {
        *self.edges_n_s.last().unwrap_or(&1.0)
    }

    /// The map of one controller: the share of recovered trials as cells and, unless there are too many, each trial as
    /// a mark.
    pub fn set(&self, controller: usize) -> String {
        let Trials(rows) = self.trials;
        let own = |has_won: bool| {
            let ended = rows.of(controller);
            (0..ended.len()).filter(move |trial| ended[*trial].has_recovered() == has_won)
        };
        let label = format!(
            "Success of {} by heading and impulse",
            rows.names[controller]
        );
        self.drawn(
            &label,
            &controller.to_string(),
            |polar| self.cells(polar, controller),
            |polar| {
                if self.trials.as_dots() {
                    self.dots(polar, "won", own(true));
                    self.crosses(polar, "lost", own(false));
                }
            },
        )
    }

    /// The map of the trials in which two controllers differ, each controller in the colour of its number in `colors`.
    /// None if there are too many trials for marks.
    pub fn pair(&self, (a, b): (usize, usize)) -> Option<String> {
        if !self.trials.as_dots() {
            return None;
        }
        let Trials(rows) = self.trials;
        let names = &rows.names;
        let label = format!(
            "Trials that only one of {} and {} recovered",
            names[a], names[b]
        );
        let common = |is_chosen: fn(bool, bool) -> bool| {
            rows.common(a, b)
                .enumerate()
                .filter(move |(_, (a, b))| is_chosen(a.has_recovered(), b.has_recovered()))
                .map(|(trial, _)| trial)
        };
        Some(self.drawn(
            &label,
            &format!("{a} {b}"),
            |_| (),
            |polar| {
                self.dots(polar, "same", common(|a, b| a && b));
                self.crosses(polar, "neither", common(|a, b| !a && !b));
                let [a, b] = [a, b].map(|controller| controller % COLORS);
                self.dots(polar, &format!("only s{a}"), common(|a, b| a && !b));
                self.dots(polar, &format!("only s{b} square"), common(|a, b| b && !a));
            },
        ))
    }

    /// A map, with `below` drawn below its rings and `over` drawn over them. The script of the page reads two
    /// attributes: the impulse at the outermost ring, and the `controllers` whose trials it offers to replay.
    fn drawn(
        &self,
        label: &str,
        controllers: &str,
        below: impl Fn(&mut Polar),
        over: impl Fn(&mut Polar),
    ) -> String {
        let most = self.most_n_s();
        let mut polar = Polar::new(RADIUS, most);
        polar.panel.class = if self.trials.len() > MANY {
            "map many"
        } else {
            "map"
        };
        below(&mut polar);
        polar.rings(&self.edges_n_s);
        over(&mut polar);
        polar.names(&self.edges_n_s);
        let label = escape(label);
        polar.panel.svg(&format!(
            "role=\"img\" aria-label=\"{label}\" data-most=\"{most}\" data-sets=\"{controllers}\""
        ))
    }

    /// A coloured cell for each part of a ring that has trials.
    fn cells(&self, polar: &mut Polar, controller: usize) {
        let width_deg = 360.0 / self.sectors as f64;
        let mut counts = vec![(0u32, 0u32); self.sectors * self.rings()];
        let Trials(rows) = self.trials;
        for (trial, ended) in rows.of(controller).iter().enumerate() {
            let (heading_deg, impulse_n_s) = (rows.heading_deg(trial), rows.impulse_n_s(trial));
            let sector =
                ((heading_deg.rem_euclid(360.0) / width_deg).round() as usize) % self.sectors;
            let ring = self.edges_n_s[1..]
                .partition_point(|edge| *edge <= impulse_n_s)
                .min(self.rings() - 1);
            let count = &mut counts[ring * self.sectors + sector];
            count.0 += u32::from(ended.has_recovered());
            count.1 += 1;
        }
        for (i, (recovered, trials)) in counts
            .into_iter()
            .enumerate()
            .filter(|(_, (_, trials))| *trials > 0)
        {
            let (ring, sector) = (i / self.sectors, i % self.sectors);
            let impulses_n_s = [self.edges_n_s[ring], self.edges_n_s[ring + 1]];
            let heading_deg = sector as f64 * width_deg;
            let headings_deg = [heading_deg - width_deg / 2.0, heading_deg + width_deg / 2.0];
            let rate = f64::from(recovered) / f64::from(trials);
            let pale = if trials < FEW { " pale" } else { "" };
            polar.panel.add(format_args!(
                "<path class=\"r{}{pale}\" d=\"{}\"><title>{} to {} N s, heading {}\u{b0}: {recovered} of {trials} \
                 recovered ({:.0} %)</title></path>",
                (rate * SHADES).round(),
                ring_part(polar, impulses_n_s, headings_deg),
                short(impulses_n_s[0], 3),
                short(impulses_n_s[1], 3),
                short(if heading_deg > 180.0 { heading_deg - 360.0 } else { heading_deg }, 1),
                100.0 * rate
            ));
        }
    }

    /// Draws a dot for each chosen trial, as a line of no length whose round ends the style sheet draws.
    fn dots(&self, polar: &mut Polar, class: &str, chosen: impl Iterator<Item = usize>) {
        self.marks(polar, class, "h0", chosen);
    }

    /// Draws a cross for each chosen trial.
    fn crosses(&self, polar: &mut Polar, class: &str, chosen: impl Iterator<Item = usize>) {
        let arm = if self.trials.len() > MANY {
            SMALL_CROSS
        } else {
            CROSS
        };
        let (arm, across) = (px(arm), px(2.0 * arm));
        self.marks(
            polar,
            class,
            &format!("m-{arm}-{arm}l{across} {across}m0-{across}l-{across} {across}"),
            chosen,
        );
    }

    /// Draws `mark`, a path that begins at the place of a trial, for each chosen trial.
    fn marks(
        &self,
        polar: &mut Polar,
        class: &str,
        mark: &str,
        chosen: impl Iterator<Item = usize>,
    ) {
        let Trials(rows) = self.trials;
        let mut path = String::new();
        for trial in chosen {
            let place = towards(rows.heading_deg(trial), rows.impulse_n_s(trial));
            let [x, y] = polar.panel.view.at(place).map(px);
            path += &format!("M{x} {y}{mark}");
        }
        polar
            .panel
            .add(format_args!("<path class=\"{class}\" d=\"{path}\"/>"));
    }
}

/// Outline of the part of a ring between two impulses (N s) and two headings (degrees).
fn ring_part(polar: &Polar, [inner, outer]: PanelPoint, [from, to]: PanelPoint) -> String {
    let place = |impulse_n_s, heading_deg| {
        polar
            .panel
            .view
            .at(towards(heading_deg, impulse_n_s))
            .map(px)
            .join(" ")
    };
    let (small, large) = (px(polar.length(inner)), px(polar.length(outer)));
    format!(
        "M{}L{}A{large} {large} 0 0 0 {}L{}A{small} {small} 0 0 1 {}z",
        place(inner, from),
        place(outer, from),
        place(outer, to),
        place(inner, to),
        place(inner, from)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Changed as _;
    use crate::fixtures::row;

    use standfast_sim::episode::Outcome;

    /// Forward is up, left is to the left, and headings that differ by a full turn are the same place.
    #[test]
    fn headings_are_seen_from_above() {
        let controllers = ["hold".to_string()];
        let turned = |trial, heading_deg, outcome| {
            row(trial, "hold", 2.0, outcome).with(|row| row.push.heading_deg = heading_deg)
        };
        let rows = [
            turned(0, 0.0, Outcome::Recovered),
            turned(1, 90.0, Outcome::Recovered),
            turned(2, -270.0, Outcome::Recovered),
            turned(3, 91.0, Outcome::Fell),
        ];
        let rows = crate::fixtures::columns_of_rows(&rows, &controllers);
        let trials = Trials(&rows);
        let maps = Maps::new(vec![0.0, 1.0, 2.0], &trials);
        let view = Polar::new(RADIUS, 2.0).panel.view;
        let ([x, y], [left, level]) = (view.at(towards(0.0, 2.0)), view.at(towards(90.0, 2.0)));
        assert!(x.abs() < 1e-9 && y == -RADIUS && left == -RADIUS && level.abs() < 1e-9);
        let svg = maps.set(0);
        assert!(
            svg.contains("heading 90\u{b0}: 2 of 3 recovered (67 %)"),
            "{svg}"
        );
        assert!(
            svg.contains("heading 0\u{b0}: 1 of 1 recovered (100 %)"),
            "{svg}"
        );
    }
}
