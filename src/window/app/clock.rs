//! Keeps simulated time in step with real time. A slow machine drops frames, but it simulates every tick.

use std::time::{Duration, Instant};

/// The speeds through which the keys `-` and `+` step (simulated seconds per second).
pub const SPEEDS: [f64; 7] = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];

/// Longest time that a frame spends on catching up if physics is slower than real time.
const PATIENCE: Duration = Duration::from_millis(400);
/// Longest time that a frame spends on catching up in any case, because the window does not respond during this time.
const LONGEST: Duration = Duration::from_secs(3);

/// Longest real time that counts for a frame (s). After a longer time the display stood still or the program was
/// stopped, and the simulation continues where it was.
const LONGEST_FRAME_S: f64 = 3.0;

/// Number of frames that a display shows in a second. Frames that are not drawn count as dropped.
const DISPLAY_HZ: f64 = 60.0;

/// Keeps a simulation in step with real time.
#[derive(Debug)]
pub struct FrameClock {
    /// Chosen speed (simulated seconds per second).
    pub speed: f64,
    pub paused: bool,
    last: Instant,
    /// Real time of the last frame (s).
    pub frame_s: f64,
    /// Simulated time that is still to be computed (s).
    due_s: f64,
    /// Simulated time that was skipped (s), since physics was slower than real time.
    pub lost_s: f64,
    /// Number of frames that were drawn.
    pub frames: u64,
    /// Number of frames of the display that were not drawn.
    pub dropped: u64,
    /// Measured speed over the last second (simulated seconds per second). None while paused, and until it is known.
    pub factor: Option<f64>,
    /// Frames per second, over the last second.
    pub frames_per_s: f64,
    /// Simulated time (s), real time (s) and frames since the last measurement.
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

    /// Chooses the next speed of the list, up or down.
    pub fn change_speed(&mut self, up: bool) {
        let (slower, faster) = (
            |s: &f64| *s < self.speed * (1.0 - 1e-6),
            |s: &f64| *s > self.speed * (1.0 + 1e-6),
        );
        let other = if up {
            SPEEDS.into_iter().find(faster)
        } else {
            SPEEDS.into_iter().rfind(slower)
        };
        self.set_speed(other.unwrap_or(self.speed));
    }

    /// Chooses a speed, and measures the speed anew.
    pub fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
        self.forget();
    }

    /// Discards the measured speed and begins to measure anew.
    fn forget(&mut self) {
        (self.factor, self.stretch) = (None, [0.0; 3]);
    }

    /// Ignores the time since the last frame, in which the window was not open yet.
    pub fn skip(&mut self) {
        self.last = Instant::now();
    }

    /// Begins a frame: the real time since the last frame is to be simulated.
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

    /// Calls `advance`, which simulates `step_s` (s), as often as is due, until it returns false. If physics is slower
    /// than real time, the remaining time is dropped: every tick is simulated, but the simulation falls behind real
    /// time. If only drawing is slow, all due time is simulated, and the next frames have less to do.
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
    fn all_time_is_simulated_with_any_number_of_frames() {
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
        assert!(
            (0.5 * passed_s - f64::from(ticks) * 0.002).abs() < 0.004,
            "{ticks} ticks in {passed_s} s"
        );
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
        // Three seconds at twice the speed are 3000 ticks, or one less by rounding.
        assert!(
            (2999..=3000).contains(&ticks) && clock.lost_s == 0.0,
            "{ticks} {}",
            clock.lost_s
        );
        assert!(
            clock.stretch[0] <= clock.speed * clock.stretch[1],
            "{:?}",
            clock.stretch
        );
    }

    #[test]
    fn speeds_go_through_the_list() {
        let mut clock = FrameClock::new(1.0);
        clock.change_speed(false);
        assert_eq!(clock.speed, 0.5);
        clock.set_speed(0.3);
        clock.change_speed(true);
        assert_eq!(clock.speed, 0.5);
        for _ in 0..9 {
            clock.change_speed(true);
        }
        assert_eq!(clock.speed, SPEEDS[6]);
    }

    #[test]
    fn only_physics_slower_than_real_time_loses_time() {
        let ticks = |tick_ms: u64, speed: f64| {
            let mut clock = FrameClock {
                due_s: 2.0,
                ..FrameClock::new(speed)
            };
            let mut ticks = 0;
            clock.catch_up(0.02, || {
                ticks += 1;
                sleep(Duration::from_millis(tick_ms));
                true
            });
            (ticks, clock.lost_s, clock.due_s)
        };
        // This takes longer than the patience, but is faster than real time.
        let (done, lost_s, due_s) = ticks(6, 1.0);
        assert!(
            done >= 99 && lost_s == 0.0 && due_s < 0.0201,
            "{done} {lost_s} {due_s}"
        );
        // This is slower than real time, and stops when the patience ends.
        let (done, lost_s, due_s) = ticks(6, 4.0);
        assert!((10..90).contains(&done) && due_s == 0.0, "{done} {due_s}");
        assert!(
            (lost_s - (2.0 - 0.02 * f64::from(done))).abs() < 1e-6,
            "{lost_s}"
        );
    }

    #[test]
    fn the_measured_speed_is_forgotten_when_the_speed_changes_or_time_stops() {
        let measured = || {
            let mut clock = FrameClock {
                stretch: [2.0, 1.0, 1.0],
                ..FrameClock::new(2.0)
            };
            clock.begin_frame();
            assert_eq!(clock.factor, Some(2.0));
            clock
        };
        let mut clock = measured();
        clock.change_speed(false);
        assert_eq!((clock.speed, clock.factor), (1.0, None));
        let mut clock = FrameClock {
            due_s: 0.1,
            ..measured()
        };
        clock.catch_up(0.002, || false);
        assert_eq!((clock.factor, clock.lost_s), (None, 0.0));
    }
}
