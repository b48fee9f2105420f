//! From the time on the wall to simulated time: a slow machine drops frames, never simulated time.

use std::time::{Duration, Instant};

/// What `slower` and `faster` go through (simulated seconds per second).
pub const SPEEDS: [f64; 7] = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];

/// One frame spends no more than this on catching up where the physics is slower than the wall,
const PATIENCE: Duration = Duration::from_millis(400);
/// and no more than this where it is not: beyond it the window would no longer answer.
const LONGEST: Duration = Duration::from_secs(3);

/// No frame is to bring more of the wall's time (s): what lasts longer is no slow frame but a display that stood still,
/// or a program that was stopped.
const LONGEST_FRAME_S: f64 = 3.0;

/// Frames that a display shows in a second: what is not drawn of them counts as dropped.
const DISPLAY_HZ: f64 = 60.0;

/// Keeps a simulation in step with the wall.
#[derive(Debug)]
pub struct FrameClock {
    /// Simulated seconds per second, as wished.
    pub speed: f64,
    pub paused: bool,
    last: Instant,
    /// Wall time of the last frame (s).
    pub frame_s: f64,
    /// Simulated time that is due (s).
    due_s: f64,
    /// Simulated time that was due and never came (s): physics was slower than the wall.
    pub lost_s: f64,
    /// Frames drawn, and those of the display that were not.
    pub frames: u64,
    pub dropped: u64,
    /// Simulated seconds per second, of late; None while paused, or where that is not known yet.
    pub factor: Option<f64>,
    /// Frames drawn per second, of late.
    pub frames_per_s: f64,
    /// What the two are taken over: simulated and wall time (s), and frames.
    stretch: [f64; 3],
}

impl FrameClock {
    pub fn new(speed: f64) -> Self {
        Self {
            speed,
            paused: false,
            last: Instant::now(),
            frame_s: 0.0,
            due_s: 0.0,
            lost_s: 0.0,
            frames: 0,
            dropped: 0,
            factor: None,
            frames_per_s: 0.0,
            stretch: [0.0; 3],
        }
    }

    /// The next speed of the list, up or down.
    pub fn change_speed(&mut self, up: bool) {
        let (slower, faster) = (|s: &f64| *s < self.speed * (1.0 - 1e-6), |s: &f64| *s > self.speed * (1.0 + 1e-6));
        let other = if up { SPEEDS.into_iter().find(faster) } else { SPEEDS.into_iter().rfind(slower) };
        self.set_speed(other.unwrap_or(self.speed));
    }

    /// Goes on at another speed. How fast it was before says nothing of that.
    pub fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
        self.forget();
    }

    /// Begins to measure anew.
    fn forget(&mut self) {
        (self.factor, self.stretch) = (None, [0.0; 3]);
    }

    /// What has passed since the last frame is not to be simulated: the window was not there yet.
    pub fn skip(&mut self) {
        self.last = Instant::now();
    }

    /// Begins a frame: the wall time since the last one becomes due.
    pub fn begin_frame(&mut self) {
        let stood_s = self.last.elapsed().as_secs_f64();
        let passed_s = stood_s.min(LONGEST_FRAME_S);
        (self.last, self.frame_s) = (Instant::now(), passed_s);
        self.frames += 1;
        self.dropped += (stood_s * DISPLAY_HZ).round().max(1.0) as u64 - 1;
        if stood_s > passed_s {
            self.forget();
        }
        if self.paused {
            self.due_s = 0.0;
            self.forget();
            return;
        }
        let [simulated_s, wall_s, frames] = self.stretch;
        if wall_s >= 1.0 {
            (self.factor, self.frames_per_s) = (Some(simulated_s / wall_s), frames / wall_s);
            self.stretch = [0.0; 3];
        }
        self.due_s += passed_s * self.speed;
        self.stretch[1] += passed_s;
        self.stretch[2] += 1.0;
    }

    /// Runs `advance` by `step_s` of simulated time as often as is due; it says whether it can go on. What a machine
    /// whose physics is slower than the wall cannot do in time is lost: the simulation is complete, but late. Where
    /// only drawing is slow a frame takes as long as it needs: the next ones need less.
    pub fn catch_up(&mut self, step_s: f64, mut advance: impl FnMut() -> bool) {
        let (start, mut done_s) = (Instant::now(), 0.0);
        while self.due_s >= step_s {
            let spent = start.elapsed();
            let is_late = spent > PATIENCE && done_s < self.speed * spent.as_secs_f64();
            if is_late || spent > LONGEST {
                self.lost_s += self.due_s;
                self.due_s = 0.0;
                return;
            }
            if !advance() {
                self.due_s = 0.0;
                self.forget();
                return;
            }
            self.due_s -= step_s;
            self.stretch[0] += step_s;
            done_s += step_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread::sleep;

    #[test]
    fn all_time_that_passes_is_simulated_however_few_frames_there_are() {
        let mut clock = FrameClock::new(0.5);
        let (start, mut ticks) = (Instant::now(), 0);
        for pause_ms in [5, 60, 110, 3] {
            sleep(Duration::from_millis(pause_ms));
            clock.begin_frame();
            clock.catch_up(0.002, || {
                ticks += 1;
                true
            });
        }
        let passed_s = start.elapsed().as_secs_f64();
        assert!((0.5 * passed_s - f64::from(ticks) * 0.002).abs() < 0.004, "{ticks} ticks in {passed_s} s");
        assert_eq!(clock.frames, 4);
        assert!(clock.dropped >= 8, "{}", clock.dropped);
        clock.paused = true;
        sleep(Duration::from_millis(10));
        clock.begin_frame();
        clock.catch_up(0.002, || panic!("it is paused"));
    }

    #[test]
    fn a_program_that_was_stopped_goes_on_where_it_was() {
        let mut clock = FrameClock::new(2.0);
        clock.last -= Duration::from_secs(100);
        clock.stretch = [0.5, 0.5, 1.0];
        clock.begin_frame();
        let mut ticks = 0;
        clock.catch_up(0.002, || {
            ticks += 1;
            true
        });
        // Three seconds at twice the speed, but for what rounding leaves.
        assert!((2999..=3000).contains(&ticks) && clock.lost_s == 0.0, "{ticks} {}", clock.lost_s);
        assert!(clock.stretch[0] <= clock.speed * clock.stretch[1], "{:?}", clock.stretch);
    }

    #[test]
    fn speeds_go_through_the_list() {
        let mut clock = FrameClock::new(1.0);
        clock.change_speed(false);
        assert_eq!(clock.speed, 0.5);
        clock.set_speed(0.3);
        clock.change_speed(true);
        assert_eq!(clock.speed, 0.5);
        (0..9).for_each(|_| clock.change_speed(true));
        assert_eq!(clock.speed, SPEEDS[6]);
    }

    #[test]
    fn only_physics_that_is_slower_than_the_wall_loses_time() {
        let ticks = |tick_ms: u64, speed: f64| {
            let mut clock = FrameClock { due_s: 2.0, ..FrameClock::new(speed) };
            let mut ticks = 0;
            clock.catch_up(0.02, || {
                ticks += 1;
                sleep(Duration::from_millis(tick_ms));
                true
            });
            (ticks, clock.lost_s, clock.due_s)
        };
        // Longer than the patience, but faster than the wall.
        let (done, lost_s, due_s) = ticks(6, 1.0);
        assert!(done >= 99 && lost_s == 0.0 && due_s < 0.0201, "{done} {lost_s} {due_s}");
        // Slower: it stops when the patience ends.
        let (done, lost_s, due_s) = ticks(6, 4.0);
        assert!((10..90).contains(&done) && due_s == 0.0, "{done} {due_s}");
        assert!((lost_s - (2.0 - 0.02 * f64::from(done))).abs() < 1e-6, "{lost_s}");
    }

    #[test]
    fn the_factor_is_that_of_the_speed_and_of_what_goes_on() {
        let measured = || {
            let mut clock = FrameClock { stretch: [2.0, 1.0, 1.0], ..FrameClock::new(2.0) };
            clock.begin_frame();
            assert_eq!(clock.factor, Some(2.0));
            clock
        };
        let mut clock = measured();
        clock.change_speed(false);
        assert_eq!((clock.speed, clock.factor), (1.0, None));
        let mut clock = FrameClock { due_s: 0.1, ..measured() };
        clock.catch_up(0.002, || false);
        assert_eq!((clock.factor, clock.lost_s), (None, 0.0));
    }
}
