//! The window's loop: what a person asks for, time that passes, the next picture.

mod clock;
mod colors;
mod keys;
mod live;
mod marks;
mod mesh;
mod overlays;
mod panel;
mod pick;
mod plots;
mod recorded;
mod scene;
mod show;
mod solids;
mod timeline;
mod watch;
mod window;
mod world;

use crate::error::{Error, Result};
use crate::report::check_output;
use crate::view::ViewArgs;
use clock::Clock;
use keys::Wish;
use kiss3d::camera::OrbitCamera3d;
use kiss3d::egui::{self, LayerId, Pos2, Rect, Theme, pos2};
use kiss3d::event::{Action, MouseButton, WindowEvent};
use kiss3d::post_processing::Tonemap;
use kiss3d::window::{NumSamples, Window};
use live::Live;
use marks::{Lens, Marks};
use overlays::Shown;
use panel::Facts;
use pick::Grab;
use recorded::Recorded;
use scene::{Leash, Scene, camera};
use show::{Show, several};
use std::path::Path;
use std::time::Instant;
use watch::Watch;
use world::World;

/// Size of the window at the start (pixels).
const SIZE: (u32, u32) = (1200, 720);
/// Fewer frames a second than this: the machine draws without a graphics card, and edges are no longer smoothed.
const SLOW_FRAMES_PER_S: f64 = 25.0;

/// Opens the window, and returns what happened when it is closed. Errors: what is named is not there or not accepted;
/// there can be no window ([`Error::NoWindow`]); the picture cannot be written.
pub fn run(args: &ViewArgs) -> Result<String> {
    check(args)?;
    if let Some(path) = &args.screenshot {
        check_output("--screenshot", path, &["png"])?;
    }
    match (&args.dir, args.trial) {
        (Some(folder), Some(trial)) => {
            let recorded = Recorded::new(folder, trial, args)?;
            let (robot, ground) = (recorded.film.robot.clone(), recorded.ground);
            App::open(args, Show::Recorded(Box::new(recorded)), None)?.run(args, Scene::new(&robot, ground))
        }
        _ => {
            let world = World::new(args)?;
            let scene = || Scene::new(&world.simulated, world.ground());
            let app = App::open(args, Show::Live(Box::new(Live::new(&world))), Some(&world))?;
            app.run(args, scene())
        }
    }
}

fn check(args: &ViewArgs) -> Result<()> {
    let positive = |name: &str, value: f64, most: f64| {
        if value > 0.0 && value <= most {
            return Ok(());
        }
        Err(Error::value("arguments", name, value, "out of range", format!("more than 0, at most {most}")))
    };
    positive("--speed", args.speed, 10.0)?;
    args.seconds.map_or(Ok(()), |seconds| positive("--seconds", seconds, 1e6))?;
    if !(0.0..=MOST_N_S).contains(&args.impulse) {
        let accepted = format!("0 to {MOST_N_S}");
        return Err(Error::value("arguments", "--impulse", args.impulse, "out of range", accepted));
    }
    if !args.heading.is_finite() {
        return Err(Error::value("arguments", "--heading", args.heading, "out of range", "-180 to 180"));
    }
    Ok(())
}

/// The largest push by key (N s).
const MOST_N_S: f64 = 20.0;

struct App<'a> {
    window: Window,
    camera: OrbitCamera3d,
    leash: Leash,
    show: Show<'a>,
    world: Option<&'a World>,
    clock: Clock,
    shown: Shown,
    /// Of the next push.
    impulse_n_s: f64,
    heading_deg: f64,
    help: bool,
    quits: bool,
    /// Where the mouse was last seen (pixels).
    cursor: Option<(f64, f64)>,
}

impl<'a> App<'a> {
    fn open(args: &ViewArgs, show: Show<'a>, world: Option<&'a World>) -> Result<Self> {
        let mut window = window::open("standfast", SIZE.0, SIZE.1)?;
        window.set_background_color(colors::SKY.line());
        window.set_shadows_enabled(false);
        // Colours as they are named.
        window.set_tonemap(Tonemap::None);
        window.rebind_close_key(None);
        window.egui_context_mut().set_theme(Theme::Light);
        Ok(Self {
            window,
            camera: camera(),
            leash: Leash::default(),
            show,
            world,
            clock: Clock::new(args.speed),
            shown: Shown::default(),
            impulse_n_s: args.impulse,
            heading_deg: wrapped(args.heading),
            help: true,
            quits: false,
            cursor: None,
        })
    }

    fn run(mut self, args: &ViewArgs, mut scene: Scene) -> Result<String> {
        let (start, watch) = (Instant::now(), Watch::start());
        let is_due = |start: &Instant| args.seconds.is_some_and(|s| start.elapsed().as_secs_f64() >= s);
        loop {
            let mut wishes = self.input();
            self.clock.begin_frame();
            self.advance();
            // Not under a hand: what it holds would move with the picture.
            if !matches!(&self.show, Show::Live(live) if live.grab.is_some()) {
                self.leash.pull(&mut self.camera, &self.show.now().com, self.clock.frame_s);
            }
            self.draw(&mut scene, &mut wishes);
            wishes.into_iter().for_each(|wish| self.grant(wish));
            let goes_on = match window::render(&mut self.window, &mut scene.root, &mut self.camera) {
                Ok(goes_on) => goes_on,
                Err(error) => {
                    // A window that is gone cannot be closed.
                    std::mem::forget(self);
                    return Err(error);
                }
            };
            watch.beat();
            let (frames, _) = self.clock.frames();
            if frames == 1 {
                self.clock.skip();
            }
            let (now, speed) = (self.show.now(), self.clock.speed());
            let [x_mm, y_mm, _] = <[f64; 3]>::from(now.com * 1000.0);
            log::trace!("frame {frames}: {:.3} s, speed {speed}, COM {x_mm:.1} {y_mm:.1} mm", now.time_s);
            let is_slow = (0.1..SLOW_FRAMES_PER_S).contains(&self.clock.frames_per_s);
            if is_slow && self.window.samples() > 1 {
                self.window.set_samples(NumSamples::One);
            }
            if self.quits || !goes_on || is_due(&start) {
                break;
            }
        }
        if let Some(path) = &args.screenshot {
            write_picture(&self.window, path)?;
        }
        let ((frames, dropped), lost_s) = (self.clock.frames(), self.clock.lost_s());
        let (frames, seconds) = (several(frames, "frame", "frames"), start.elapsed().as_secs_f64());
        let mut drawn = format!("{frames} drawn, {dropped} dropped, in {seconds:.1} s");
        if lost_s > 0.0 {
            drawn += &format!("; physics was slower than the wall by {lost_s:.1} s");
        }
        Ok(format!("{}; {drawn}\n", self.show.account(self.step_s())))
    }

    /// What the keys ask for; the mouse takes hold of the robot here.
    fn input(&mut self) -> Vec<Wish> {
        let (mut wishes, live) = (Vec::new(), matches!(self.show, Show::Live(_)));
        for mut event in self.window.events().iter() {
            match event.value {
                WindowEvent::Key(key, Action::Press, _) if !self.window.is_egui_capturing_keyboard() => {
                    let wish = keys::wish(key, live);
                    event.inhibited = wish.is_some();
                    wishes.extend(wish);
                }
                WindowEvent::CursorPos(x, y, _) => self.cursor = Some((x, y)),
                WindowEvent::MouseButton(MouseButton::Button1, action, _) => match action {
                    Action::Press if !self.window.is_egui_capturing_mouse() => self.take(),
                    Action::Press => {}
                    Action::Release => self.let_go(),
                },
                _ => {}
            }
        }
        let lens = self.lens();
        let sight = self.mouse().map(|at| lens.sight(at));
        if let (Show::Live(live), Some(sight)) = (&mut self.show, sight) {
            live.grab.iter_mut().for_each(|grab| grab.follow(&sight));
        }
        wishes
    }

    /// Takes hold of the link under the mouse; else the camera turns.
    fn take(&mut self) {
        let (lens, mouse) = (self.lens(), self.mouse());
        let (Show::Live(live), Some(world), Some(mouse)) = (&mut self.show, self.world, mouse) else { return };
        let sight = lens.sight(mouse);
        if let Some(hit) = pick::pick(&world.simulated, &live.kinematics, &sight) {
            live.take(Grab::new(hit, &sight, &live.kinematics, lens.looking()));
            self.camera.rebind_rotate_button(None);
        }
    }

    fn let_go(&mut self) {
        if let Show::Live(live) = &mut self.show {
            live.let_go();
        }
        self.camera.rebind_rotate_button(Some(MouseButton::Button1));
    }

    /// Lets the time that has passed pass in the simulation.
    fn advance(&mut self) {
        let step_s = self.step_s();
        match &mut self.show {
            Show::Live(live) => self.clock.catch_up(step_s, || live.advance()),
            Show::Recorded(recorded) => self.clock.catch_up(step_s, || recorded.go(1)),
        }
        if matches!(&self.show, Show::Recorded(recorded) if recorded.is_at_end()) {
            self.clock.paused = true;
        }
    }

    fn step_s(&self) -> f64 {
        match &self.show {
            Show::Live(_) => self.world.map_or(0.002, |world| world.config.control_period_s),
            Show::Recorded(recorded) => recorded.film.control_period_s,
        }
    }

    fn draw(&mut self, scene: &mut Scene, wishes: &mut Vec<Wish>) {
        let lens = self.lens();
        let eye = kiss3d::camera::Camera3d::eye(&self.camera);
        let (now, kinematics) = (self.show.now(), self.show.kinematics());
        scene.draw(now, kinematics, &self.shown, eye, &mut self.window);
        let mouse = self.mouse().filter(|_| !self.window.is_egui_capturing_mouse());
        // Opens a frame of the context, which the handle then stands for.
        self.window.draw_ui(|_| {});
        let ctx = &self.window.egui_context().clone();
        let push = self.world.map(|_| (self.impulse_n_s, self.heading_deg));
        let facts = self.facts(push);
        let (show, shown, ground) = (&self.show, &self.shown, scene.ground(now));
        let (world, paused) = (self.world, self.clock.paused);
        let wide = ctx.content_rect().width() - panel::WIDTH;
        let name = mouse.and_then(|at| Some((at, show.link_at(world?, &lens.sight(at))?)));
        let painter = ctx.layer_painter(LayerId::background());
        let free = Rect::from_min_max(Pos2::ZERO, pos2(wide, ctx.content_rect().bottom()));
        let marks = Marks { painter: painter.with_clip_rect(free), lens: &lens, ground };
        marks.axes();
        if let Some((impulse_n_s, heading_deg)) = push {
            marks.aim(now, impulse_n_s, heading_deg);
        }
        marks.draw(now, shown, show.force());
        if let Some((at, name)) = name {
            marks.name(at, name);
        }
        if self.help {
            panel::help(ctx, push.is_some());
        }
        panel::draw(ctx, &facts, wishes);
        if let Show::Recorded(recorded) = show {
            timeline::draw(ctx, recorded, paused, wide, wishes);
        }
    }

    fn facts(&self, push: Option<(f64, f64)>) -> Facts<'_> {
        let (gain_sets, acting, gains) = self.show.gain_sets(self.world);
        Facts {
            now: self.show.now(),
            trail: self.show.trail(),
            clock: &self.clock,
            shown: &self.shown,
            gain_sets,
            acting,
            gains,
            verdict: self.show.verdict(),
            push,
            recording: self.show.recording(),
        }
    }

    fn grant(&mut self, wish: Wish) {
        log::debug!("{wish:?}");
        match (wish, &mut self.show) {
            (Wish::Pause, Show::Recorded(recorded)) => {
                if self.clock.paused && recorded.is_at_end() {
                    recorded.seek(0.0);
                }
                self.clock.paused ^= true;
            }
            (Wish::Pause, Show::Live(_)) => self.clock.paused ^= true,
            (Wish::Ticks(ticks), show) => {
                self.clock.paused = true;
                match show {
                    Show::Live(live) => {
                        live.advance();
                        live.counts.single_ticks += 1;
                    }
                    Show::Recorded(recorded) => _ = recorded.go(ticks),
                }
            }
            (Wish::Restart, Show::Live(live)) => live.restart(),
            (Wish::Faster, _) => self.clock.change_speed(true),
            (Wish::Slower, _) => self.clock.change_speed(false),
            (Wish::Speed(speed), _) => self.clock.set_speed(speed),
            (Wish::Push, Show::Live(live)) => live.push(self.impulse_n_s, self.heading_deg),
            (Wish::Impulse(more), _) => self.impulse_n_s = (self.impulse_n_s + more).clamp(0.0, MOST_N_S),
            (Wish::Heading(turn), _) => self.heading_deg = wrapped(self.heading_deg + turn),
            (Wish::GainSet(index), Show::Live(live)) => live.switch_to(index),
            (Wish::Toggle(overlay), _) => self.shown.toggle(overlay),
            (Wish::Seek(time_s), Show::Recorded(recorded)) => {
                self.clock.paused = true;
                recorded.seek(time_s.min(recorded.end_s()));
            }
            (Wish::Skip(by_s), Show::Recorded(recorded)) => {
                let to_s = recorded.now().time_s + by_s;
                recorded.seek(to_s);
            }
            (Wish::ResetCamera, _) => (self.camera, self.leash) = (camera(), Leash::default()),
            (Wish::Help, _) => self.help ^= true,
            (Wish::Quit, _) => self.quits = true,
            (Wish::Restart | Wish::Push | Wish::GainSet(_), Show::Recorded(_)) => {}
            (Wish::Seek(_) | Wish::Skip(_), Show::Live(_)) => {}
        }
    }

    /// The mouse in the picture (points of egui).
    fn mouse(&self) -> Option<Pos2> {
        let scale = self.window.scale_factor();
        self.cursor.map(|(x, y)| pos2((x / scale) as f32, (y / scale) as f32))
    }

    fn lens(&self) -> Lens {
        let (size, scale) = (self.window.size(), self.window.scale_factor() as f32);
        Lens::new(&self.camera, egui::vec2(size.x as f32 / scale, size.y as f32 / scale))
    }
}

/// A heading in -180 (not included) to 180 degrees.
fn wrapped(heading_deg: f64) -> f64 {
    180.0 - (180.0 - heading_deg).rem_euclid(360.0)
}

fn write_picture(window: &Window, path: &Path) -> Result<()> {
    let written = window.snap_image().save(path);
    written.map_err(|e| Error::Write { path: path.into(), source: std::io::Error::other(e) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_are_wrapped() {
        for (given, expected) in [(0.0, 0.0), (180.0, 180.0), (-180.0, 180.0), (195.0, -165.0), (-540.0, 180.0)] {
            assert_eq!(wrapped(given), expected);
        }
    }
}
