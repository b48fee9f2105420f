//! Fig. 3: the sets of the gains, one in the other.

use super::super::html::svg::short;
use super::super::plot;
use super::convergence;
use super::figure::Said::{Quote, Remark};
use super::figure::{Claim, Figure, Table};
use super::panel::{At, Axes, Ground, Panel};
use super::study::Study;
use crate::error::Result;
use crate::lipm::OnlineSets;
use crate::lipm::cpi_set::{CpiSet, Inclusion};
use crate::lipm::gains::{Gain, GainPoles};
use crate::lipm::pendulum::State;
use crate::robot::Foot;
use nalgebra::Vector2;
use serde_json::json;

/// Poles over -omega of two gains, slow to fast, whose sets do not nest.
const NOT_NESTED: [[f64; 3]; 2] = [[0.5, 1.0, 1.0], [1.0, 1.0, 1.0]];
const WIDTH: f64 = 460.0;

/// Fig. 3.
pub fn figure(study: &Study) -> Result<Figure> {
    let (sets, family) = (&study.sets, &study.design.family);
    let omega = family.pendulum.omega;
    let nests = study.inclusion.failures().is_empty();
    let impulses: Vec<[f64; 2]> = sets.iter().map(|set| study.impulses(set)).collect();
    let shrinks = impulses.windows(2).all(|pair| (0..2).all(|axis| pair[1][axis] < pair[0][axis]));
    let (others, contains, [other_slow, other_fast]) = others(study)?;
    let (slow, fast) = (impulses[0], impulses[impulses.len() - 1]);
    let told = |poles: [f64; 3]| format!("({})", poles.map(|p| short(p, 2)).join(", "));
    let pairs = sets.len() * (sets.len() - 1) / 2;
    let settles = convergence::of_gains(study);
    let quickens = settles.windows(2).all(|pair| matches!(pair, [Some(slow), Some(fast)] if fast < slow));
    let switching = convergence::of_switching(study);
    let seconds = |at: &Option<f64>| at.map_or("never".into(), |at| format!("{at:.2} s"));
    let listed = |times: &[Option<f64>]| times.iter().map(seconds).collect::<Vec<_>>().join(", ");
    let with_switching = format!(
        "After a push forward that the slowest gain's set just holds the COM is home after {} with the fastest gain whose set \
         holds the state at every tick, after {} with the slowest gain alone, on the pendulum.",
        seconds(&switching[1]),
        seconds(&switching[0])
    );
    let in_json = |[forward, left]: &[f64; 2]| json!({ "forward": forward, "left": left });
    let claims = vec![
        Claim::judged(
            Quote(
                "Suppose that the state feedback gains \u{2026} are designed so that each maximal CPI set \u{2026} satisfies the \
                 inclusion relation",
                "Sect. III.D",
            ),
            nests,
            format!(
                "They are here: proved by linear programs for all {pairs} pairs of the {} gains: each set lies inside \
            every slower one.",
                sets.len()
            ),
            study.inclusion.warning().unwrap_or_default(),
        ),
        Claim::judged(
            Quote("the sets \u{2026} are ordered according to the convergence speed", "Sect. III.D"),
            shrinks && quickens,
            format!(
                "From one state the COM is home after {} with the gains from slow to fast, on the pendulum; and the largest \
                 impulse from rest within the set falls, forward from {} to {} N s, to the left from {} to {} N s.",
                listed(&settles),
                short(slow[0], 2),
                short(fast[0], 2),
                short(slow[1], 2),
                short(fast[1], 2)
            ),
            format!(
                "Not in both: from one state the COM is home after {} with the gains from slow to fast, on the pendulum; the \
                 largest impulses forward from rest are {}.",
                listed(&settles),
                impulses.iter().map(|impulse| short(impulse[0], 2)).collect::<Vec<_>>().join(", ")
            ),
        ),
        Claim::judged(
            Quote(
                "In the switching control, the performance is improved by choosing maximum index i \u{2026} the convergence \
                 speed of the COG is improved by applying the switching control.",
                "Sect. III.D",
            ),
            matches!(switching, [alone, Some(switched)] if alone.is_none_or(|alone| switched < alone)),
            with_switching.clone(),
            with_switching,
        ),
        Claim::judged(
            Quote(
                "In general, the maximal CPI set becomes small when F with a high convergence speed is applied. On the \
                 other hand, the maximal CPI set becomes large when F with a low convergence speed is applied.",
                "Sect. III.D",
            ),
            others,
            "So it is in the family here, and for the pair of other poles that was tried.".into(),
            format!(
                "So it is in the family here, whose gains share a pole at \u{2212}\u{3c9} and a fast one and differ in \
                 the slow one alone; but not in general: of the sets of the poles {} and, faster, {} times \u{2212}\u{3c9} \
                 {}, a counterexample; from rest they hold {} and {} N s forward.",
                told(NOT_NESTED[0]),
                told(NOT_NESTED[1]),
                if contains { "the faster one contains the slower one" } else { "neither contains the other" },
                short(other_slow, 3),
                short(other_fast, 3)
            ),
        ),
        Claim::open(
            Remark("The paper prints neither its gains nor their k."),
            "The table has those of this run. Fig. 3 also shows the block diagram of switching, a drawing: Fig. \
             5 shows it at work."
                .into(),
        ),
    ];
    let rows = sets.iter().zip(&family.gains).zip(&impulses).zip(&settles).map(|(((set, gain), impulse), settles)| {
        vec![
            set.gain.clone(),
            told(gain.x.poles),
            format!("{} ({} ms)", set.horizon, short(1e3 * family.pendulum.dt * set.horizon as f64, 0)),
            set.set.rows.nrows().to_string(),
            short(impulse[0], 2),
            short(impulse[1], 2),
            seconds(settles),
        ]
    });
    let head = [
        "gain",
        "poles / \u{2212}\u{3c9}",
        "k",
        "rows of S",
        "impulse forward [N s]",
        "to the left [N s]",
        "COM home after",
    ];
    Ok(Figure {
        number: "3",
        file: "fig03-inclusion.svg",
        title: "Inclusion of the maximal CPI sets",
        reading: format!(
            "Two slices of the six-dimensional sets on the soles at home. Left: COM over the middle of the \
             feet; a push moves a robot at rest along the horizontal line, the controller moves the ZMP. Right, \
             seen from above: where a resting COM may be, with the ZMP in the middle. A gain has the name of its pole that is \
             neither \u{2212}\u{3c9} nor 5 times that; \u{3c9} = {} rad/s. The sets are for the soles less {} mm (dashed); d is \
             from the middle to that edge. Impulses of the table: the largest that a robot at rest can take within the set.",
            short(omega, 2),
            short(1e3 * family.zmp_margin, 1)
        ),
        panels: vec![velocity_slice(study), com_slice(study)],
        columns: 2,
        table: Some(Table { head: head.map(String::from).into(), rows: rows.collect() }),
        claims,
        numbers: json!({
            "nested": nests,
            "gains": sets.iter().map(|set| set.gain.clone()).collect::<Vec<_>>(),
            "horizon_k": sets.iter().map(|set| set.horizon).collect::<Vec<_>>(),
            "largest_impulse_from_rest_n_s": impulses.iter().map(in_json).collect::<Vec<_>>(),
            "other_poles_over_minus_omega": NOT_NESTED,
            "other_poles_nest": others,
            "other_poles_nest_the_other_way": contains,
            "home_after_s": settles,
            "home_after_s_slowest_and_switching": switching,
            "other_poles_forward_n_s": [other_slow, other_fast],
        }),
    })
}

/// Of `NOT_NESTED`: whether the set of the faster poles lies in that of the slower ones after all, or the other way
/// round, and the largest impulse forward from rest that each holds (N s).
fn others(study: &Study) -> Result<(bool, bool, [f64; 2])> {
    let pendulum = study.design.family.pendulum;
    let [slow, fast] = NOT_NESTED.map(|poles| {
        let gain = Gain::design(&pendulum, &GainPoles { name: "other".into(), x: poles, y: poles });
        CpiSet::search(&gain, pendulum, &study.allowed)
    });
    let sets = [slow?, fast?];
    let inside = Inclusion::of(&sets)?.inside;
    Ok((inside[1][0], inside[0][1], sets.each_ref().map(|set| study.impulses(set)[0])))
}

/// Slice com = 0 of the fore and aft axis.
fn velocity_slice(study: &Study) -> Panel {
    let sets = &study.sets;
    let omega = study.design.family.pendulum.omega;
    let most = study.home.vertices().iter().map(|v| v.x).fold(0.0, f64::max);
    let (reach, speed) = (1.18 * most, 1.18 * most * omega);
    let mut panel = Panel::new(WIDTH, 430.0);
    let axes = Axes { x: [-speed, speed], y: [-1e3 * reach, 1e3 * reach], frame: [60.0, 34.0, WIDTH - 8.0, 380.0] };
    axes.draw(&mut panel, "COM velocity, forward [m/s]", "ZMP, forward [mm]");
    panel.text("title start", [60.0, 20.0], "COM over the middle of the feet");
    let outlines: Vec<Vec<At>> =
        sets.iter().map(|set| plot::cpi::outline(set, 0, speed, reach).into_iter().map(At::from).collect()).collect();
    for outline in &outlines {
        panel.polygon("slice", &axes.all(outline.iter().copied()));
    }
    for (i, set) in sets.iter().enumerate() {
        let zmp = 0.45 * reach * (1.0 - 2.0 * i as f64 / (sets.len() - 1).max(1) as f64);
        let edge = edge(set, speed, zmp);
        leader(&mut panel, axes.at([edge, 1e3 * zmp]), axes.at([0.87 * speed, 1e3 * zmp]), &set.gain);
    }
    let limit = most - study.design.family.zmp_margin;
    for side in [-1.0, 1.0] {
        let x = side * omega * limit;
        panel.line("limit", axes.at([x, -1e3 * reach]), axes.at([x, 1e3 * reach]));
        panel.line("allowed", axes.at([-speed, side * 1e3 * limit]), axes.at([speed, side * 1e3 * limit]));
    }
    let [x, y] = axes.at([omega * limit, -1e3 * reach]);
    panel.text("limit end halo small", [x - 5.0, y - 8.0], "\u{3c9} d: most with the ZMP within d");
    panel
}

/// Slice of a resting COM with the ZMP in the middle, seen from above.
fn com_slice(study: &Study) -> Panel {
    let mut sets = OnlineSets::new(&study.design.family);
    sets.update(&study.allowed);
    let (mut panel, ground) = Ground::panel(WIDTH, [-0.08, 0.08], [-0.105, 0.105]);
    ground.draw(&mut panel, "COM at rest, ZMP in the middle");
    let stance = study.stance();
    for foot in Foot::BOTH {
        let center = Vector2::new(0.0, 0.5 * foot.side() * stance.y);
        panel.polygon("sole", &ground.all(study.sole().map(|[x, y]| [x + center.x, y + center.y])));
    }
    ground.region(&mut panel, &study.home, &study.allowed);
    for (i, set) in study.sets.iter().enumerate() {
        let slice = sets.slice(i, &State::default());
        panel.polygon("slice", &ground.all(slice.iter().map(|p| [p.x, p.y])));
        let x = 0.022 * (1.0 - 2.0 * i as f64 / (study.sets.len() - 1).max(1) as f64);
        let edge = slice.iter().map(|p| p.y).fold(0.0, f64::min);
        leader(&mut panel, ground.at([x, edge]), ground.at([x, -0.091]), &set.gain);
    }
    panel
}

/// A name with a line to where it belongs.
fn leader(panel: &mut Panel, to: At, name: At, words: &str) {
    panel.line("slice", to, name);
    panel.circle("slice", to, 2.0);
    panel.text("slice small start", [name[0] + 4.0, name[1] + 4.0], words);
}

/// The largest velocity of a COM over the middle (m/s, up to `most`) that a set holds with a ZMP (m), fore and aft.
fn edge(set: &CpiSet, most: f64, zmp: f64) -> f64 {
    let (mut inside, mut outside) = (0.0, most);
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        let holds = set.set.contains(&[0.0, middle, zmp, 0.0, 0.0, 0.0]);
        *(if holds { &mut inside } else { &mut outside }) = middle;
    }
    inside
}
