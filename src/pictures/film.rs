//! Pictures of a film: the choice of moments that tell its story, the camera, and the picture of one moment.

use super::camera::Camera;
use super::draw::draw_on;
use super::files::{png, strip};
use super::label::label;
use crate::scene::palette::Overlay;
use crate::scene::{Stage, in_short};
use image::RgbImage;
use nalgebra::Point3;
use standfast_sim::Push;
use standfast_sim::episode::{Film, Snapshot};

/// Options for the pictures of a film. Sizes are width and height (px).
#[derive(Debug, Clone, PartialEq)]
pub struct FramesOptions {
    /// Size of the picture of a moment.
    pub size: [u32; 2],
    /// Size of a moment in the strip.
    pub strip_size: [u32; 2],
    pub gif_size: [u32; 2],
    pub moments: usize,
    /// Speed of the GIF from the push to the last landing or the fall, as a share of real time. Before and after, the
    /// GIF runs in real time, or faster if it would be too long.
    pub slow_motion: f64,
}

impl Default for FramesOptions {
    fn default() -> Self {
        Self {
            size: [640, 480],
            strip_size: [240, 320],
            gif_size: [480, 360],
            moments: 8,
            slow_motion: 0.25,
        }
    }
}

/// Time for which the pictures continue after the robot stands still (s).
const REST_S: f64 = 0.5;
/// Least time between two moments (s).
const APART_S: f64 = 0.012;
/// Length of a push's arrow that is always in the picture, for a robot of the size of UT-mu2 (m).
const ARROW_M: f64 = 0.3;
/// Margin around the robot, as a share of half the width and height.
const MARGIN: f64 = 0.08;

/// The filmed robots: the robot of a film on its ground, and the robot of a second film of the same trial. The second
/// is a ghost in the same picture or, with another controller, in a picture beside it.
pub(super) struct Cast<'a> {
    pub film: &'a Film,
    second: Option<&'a Film>,
    stage: Stage<'a>,
}

impl<'a> Cast<'a> {
    pub fn new(film: &'a Film, second: Option<&'a Film>) -> Self {
        Self {
            film,
            second,
            stage: Stage::new(&film.robot, film.ground),
        }
    }

    /// All films.
    pub fn films(&self) -> impl Iterator<Item = &'a Film> {
        std::iter::once(self.film).chain(self.second)
    }

    /// The size of a picture of one robot: narrower than `size` (px) if there are two.
    pub fn size_of_one(&self, [width, height]: [u32; 2]) -> [u32; 2] {
        [
            if self.is_beside() {
                3 * width / 4
            } else {
                width
            },
            height,
        ]
    }

    fn is_beside(&self) -> bool {
        self.second
            .is_some_and(|second| second.controller != self.film.controller)
    }

    /// The second robot at snapshot `k`, or at its last snapshot.
    fn second(&self, k: usize) -> Option<&'a Snapshot> {
        let seen = self
            .second
            .map(|second| &second.snapshots[..second.near()])?;
        seen.get(k).or(seen.last())
    }

    /// The picture of snapshot `k` of the film in a size (px), with labels for its time, the speed (if it is not empty)
    /// and the phase of the controller. If two robots are beside each other, each has a picture of this size, with its
    /// controller.
    pub fn picture(&self, k: usize, camera: &Camera, size: [u32; 2], speed: &str) -> RgbImage {
        let snapshot = &self.film.snapshots[k];
        let time = format!("{:.2} s {speed}", snapshot.time_s);
        let draw = |snapshot: &Snapshot, ghost, title: &str| {
            let mut image = draw_on(&self.stage, snapshot, ghost, camera, size, &Overlay::ALL);
            label(&mut image, title.trim_end(), [10, 8]);
            label(
                &mut image,
                &in_short(snapshot),
                [10, size[1].saturating_sub(28)],
            );
            image
        };
        if !self.is_beside() {
            return draw(snapshot, self.second(k), &time);
        }
        let of_films = self
            .films()
            .zip(std::iter::once(snapshot).chain(self.second(k)));
        let images = of_films
            .map(|(film, snapshot)| draw(snapshot, None, &format!("{}: {time}", film.controller)));
        strip(&images.collect::<Vec<_>>())
    }

    /// A camera at the robot's left or right front, whichever looks more across the push. It is as near as possible
    /// while both robots are whole in the picture at all these moments.
    pub fn camera(&self, moments: impl Iterator<Item = usize>, size: [u32; 2]) -> Camera {
        let (film, stage) = (self.film, &self.stage);
        const SIDES_DEG: [f64; 2] = [52.0, -38.0];
        let heading = film.pushes.first().map_or(0.0, |push| push.heading_deg);
        let off = (SIDES_DEG[0] - heading).rem_euclid(180.0);
        let azimuth_deg = if off.min(180.0 - off) >= 30.0 {
            SIDES_DEG[0]
        } else {
            SIDES_DEG[1]
        };
        let target = Point3::origin();
        let toward = Camera {
            target,
            azimuth_deg,
            elevation_deg: 17.0,
            distance_m: 2.0,
            fov_deg: 28.0,
        };
        let arrow_m = ARROW_M * stage.scale.length();
        let mut balls = Vec::new();
        for k in moments {
            let snapshot = &film.snapshots[k];
            balls.extend(stage.extent(&snapshot.posture));
            if let Some(second) = self.second(k) {
                balls.extend(stage.extent(&second.posture));
            }
            if let Some(push) = snapshot.push {
                balls.push((push.point - push.force.normalize() * arrow_m, 0.01));
            }
        }
        toward.framing(&balls, size, MARGIN)
    }
}

/// A small picture (PNG) of the most important moment: the fall, or else the first landing, or else the end of the
/// push.
pub fn thumbnail(film: &Film) -> Vec<u8> {
    const SIZE: [u32; 2] = [200, 150];
    let record = &film.record;
    let landed_s = record.footsteps.taken.first().map(|step| step.land_s);
    let k = index(
        film,
        record
            .fell_at_s
            .or(landed_s)
            .unwrap_or(pushed_until_s(film)),
    );
    let Some(snapshot) = film.snapshots.get(k) else {
        return Vec::new();
    };
    let cast = Cast::new(film, None);
    let camera = cast.camera(std::iter::once(k), SIZE);
    png(&draw_on(
        &cast.stage,
        snapshot,
        None,
        &camera,
        SIZE,
        &Overlay::ALL,
    ))
}

/// Time after which nothing more happens (s), since the robots stand still or have flown off.
pub(super) fn end_s(cast: &Cast) -> f64 {
    let ends_s = cast.films().map(|film| {
        let last_s = film.snapshots[..film.near()]
            .last()
            .map_or(0.0, |snapshot| snapshot.time_s);
        match (film.record.fell_at_s, film.record.settled_at_s) {
            (None, Some(at)) => last_s.min(at.max(pushed_until_s(film)) + REST_S),
            _ => last_s,
        }
    });
    ends_s.fold(0.0, f64::max)
}

/// Start of the first push (s).
pub(super) fn pushed_from_s(film: &Film) -> f64 {
    film.pushes
        .iter()
        .map(|push| push.start_s)
        .reduce(f64::min)
        .unwrap_or(0.0)
}

/// End of the last push (s).
pub(super) fn pushed_until_s(film: &Film) -> f64 {
    film.pushes.iter().map(Push::end_s).fold(0.0, f64::max)
}

/// Index of the snapshot nearest to a time.
pub(super) fn index(film: &Film, time_s: f64) -> usize {
    let first_s = film
        .snapshots
        .first()
        .map_or(0.0, |snapshot| snapshot.time_s);
    let k = ((time_s - first_s) / film.control_period_s)
        .round()
        .max(0.0) as usize;
    k.min(film.snapshots.len().saturating_sub(1))
}

/// Indices of the most important moments, in order: before the push, at its end, at lift, mid swing and landing of each
/// footstep, at the fall, and at the end. To get `count` moments, the most crowded are left out, or the widest gaps
/// filled.
pub(super) fn moments(cast: &Cast, count: usize) -> Vec<usize> {
    let (film, end_s) = (cast.film, end_s(cast));
    let record = &film.record;
    let mut times = vec![(pushed_from_s(film) - 2.0 * APART_S).max(0.0)];
    times.extend(film.pushes.iter().map(Push::end_s));
    for step in &record.footsteps.taken {
        times.extend([step.lift_s, (step.lift_s + step.land_s) / 2.0, step.land_s]);
    }
    times.extend(record.footsteps.lifted.map(|step| step.lift_s));
    times.extend(record.fell_at_s);
    times.retain(|&time| time < end_s - APART_S);
    times.push(end_s);
    times.sort_by(f64::total_cmp);
    times.dedup_by(|later, earlier| *later - *earlier < APART_S);
    while times.len() > count.max(2) {
        let room = |i: &usize| times[i + 1] - times[i - 1];
        let crowded = (1..times.len() - 1).min_by(|a, b| room(a).total_cmp(&room(b)));
        let Some(i) = crowded else { break };
        times.remove(i);
    }
    while times.len() < count {
        // The last gap counts less, since little happens while the robot comes to rest.
        let gap =
            |i: &usize| (times[i + 1] - times[*i]) * if i + 2 == times.len() { 0.3 } else { 1.0 };
        let widest = (0..times.len() - 1).max_by(|a, b| gap(a).total_cmp(&gap(b)));
        let Some(i) = widest.filter(|i| gap(i) > APART_S) else {
            break;
        };
        // In the last gap the new moment is early, for the same reason.
        let share = if i + 2 == times.len() { 0.3 } else { 0.5 };
        times.insert(i + 1, times[i] + share * (times[i + 1] - times[i]));
    }
    let mut moments: Vec<usize> = times.into_iter().map(|time| index(film, time)).collect();
    moments.dedup();
    moments
}
