//! The window and its loop: take the user's input, simulate the time that has passed, and draw the next picture.

mod aim;
mod camera;
mod clock;
mod colors;
mod keys;
mod live;
mod marks;
mod panel;
mod pick;
mod plots;
mod simulation;
mod space;
mod transparent;
mod triangles;
mod watchdog;
mod window;
mod world;

use crate::Options;
use aim::Aim;
use camera::{Leash, Lens, camera};
use clock::FrameClock;
use colors::OnScreen as _;
use keys::{Keyboard, Wish};
use kiss3d::camera::OrbitCamera3d;
use kiss3d::egui::{self, LayerId, Pos2, Rect, Theme, pos2};
use kiss3d::event::{Action, MouseButton, WindowEvent};
use kiss3d::post_processing::Tonemap;
use kiss3d::window::{NumSamples, Window};
use live::{Live, several};
use marks::Marks;
use nalgebra::{Isometry3, Point3};
use panel::Seen;
use pick::{Grab, pick_near};
use simulation::Simulation;
use space::Space;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Units;
use standfast_scene::Surface;
use standfast_scene::palette::{GHOST_MARKS, Overlay, Style};
use std::path::Path;
use std::time::Instant;
use watchdog::Watchdog;
pub use world::LiveSetup;

/// Size of the window at the start (pixels).
const SIZE: (u32, u32) = (1200, 720);
/// Frame rate below which the machine counts as drawing without a graphics card; edges are then no longer smoothed.
const SLOW_FRAMES_PER_S: f64 = 25.0;

/// Opens the window and, after it was closed, returns a text on the events. Fails for bad options, if no window can be
/// opened ([`Error::NoWindow`]), or if the picture cannot be written.
pub fn run(world: &LiveSetup, args: &Options) -> Result<String> {
    check(args)?;
    App::open(args, world)?.run(args)
}

/// Checks the options that are neither files nor names.
fn check(args: &Options) -> Result<()> {
    let positive = |name: &str, value: f64, most: f64| {
        if value > 0.0 && value <= most {
            return Ok(());
        }
        Err(Error::option(
            name,
            value,
            "out of range",
            format!("more than 0, at most {most}"),
        ))
    };
    positive("--speed", args.speed, 10.0)?;
    match args.seconds {
        Some(seconds) => positive("--seconds", seconds, 1e6),
        None => Ok(()),
    }
}

/// The window and its state.
struct App<'a> {
    window: Window,
    camera: OrbitCamera3d,
    leash: Leash,
    space: Space<'a>,
    live: Live<'a>,
    clock: FrameClock,
    shown: Vec<Overlay>,
    aim: Aim,
    keyboard: Keyboard,
    help: bool,
    quits: bool,
    /// Last position of the mouse (pixels).
    cursor: Option<(f64, f64)>,
}

impl<'a> App<'a> {
    fn open(args: &Options, world: &'a LiveSetup) -> Result<Self> {
        let stage = world.stage();
        let scale = stage.scale;
        let aim = Aim::new(args.impulse, args.heading, &Units::of(&world.robot))?;
        let mut window = window::open("standfast", SIZE.0, SIZE.1)?;
        window.set_background_color(colors::SKY.line());
        window.set_shadows_enabled(false);
        // Without tone mapping, colours are drawn as they are defined.
        window.set_tonemap(Tonemap::None);
        window.rebind_close_key(None);
        window.egui_context_mut().set_theme(Theme::Light);
        Ok(Self {
            window,
            camera: camera(scale),
            leash: Leash::of(scale),
            space: Space::new(stage),
            live: Live::new(world),
            clock: FrameClock::new(args.speed),
            shown: Overlay::ALL.to_vec(),
            aim,
            keyboard: Keyboard::default(),
            help: true,
            quits: false,
            cursor: None,
        })
    }

    fn run(mut self, args: &Options) -> Result<String> {
        let (start, watch) = (Instant::now(), Watchdog::start());
        loop {
            let mut wishes = self.input();
            self.clock.begin_frame();
            self.advance();
            // While the mouse pulls, the camera stays, because otherwise the camera would move the pulled point.
            if self.live.grab.is_none() {
                self.leash.pull(
                    &mut self.camera,
                    &self.live.shown.now.com,
                    self.clock.frame_s,
                );
            }
            self.draw(&mut wishes);
            for wish in wishes {
                self.grant(wish);
            }
            let goes_on =
                match window::render(&mut self.window, &mut self.space.root, &mut self.camera) {
                    Ok(goes_on) => goes_on,
                    Err(error) => {
                        // Closing a window that is lost would fail again.
                        std::mem::forget(self);
                        return Err(error);
                    }
                };
            watch.beat();
            let FrameClock { frames, speed, .. } = self.clock;
            if frames == 1 {
                self.clock.skip();
            }
            let now = &self.live.shown.now;
            let [x_mm, y_mm, _] = <[f64; 3]>::from(now.com * 1000.0);
            log::trace!(
                "frame {frames}: {:.3} s, speed {speed}, COM {x_mm:.1} {y_mm:.1} mm",
                now.time_s
            );
            let is_slow = (0.1..SLOW_FRAMES_PER_S).contains(&self.clock.frames_per_s);
            if is_slow && self.window.samples() > 1 {
                self.window.set_samples(NumSamples::One);
            }
            let is_due = args
                .seconds
                .is_some_and(|s| start.elapsed().as_secs_f64() >= s);
            if self.quits || !goes_on || is_due {
                break;
            }
        }
        if let Some(path) = &args.screenshot {
            write_picture(&self.window, path)?;
        }
        let FrameClock {
            frames,
            dropped,
            lost_s,
            ..
        } = self.clock;
        let (frames, seconds) = (
            several(frames, "frame", "frames"),
            start.elapsed().as_secs_f64(),
        );
        let mut drawn = format!("{frames} drawn, {dropped} dropped, in {seconds:.1} s");
        // A smaller delay would be printed as 0.0 s.
        if lost_s >= 0.05 {
            drawn += &format!("; the physics fell behind real time by {lost_s:.1} s");
        }
        Ok(format!("{}; {drawn}\n", self.live.account()))
    }

    /// The wishes of the keys since the last frame. The mouse acts on the robot at once.
    fn input(&mut self) -> Vec<Wish> {
        let mut wishes = Vec::new();
        for event in self.window.events().iter() {
            let is_typing = self.window.is_egui_capturing_keyboard();
            match event.value {
                WindowEvent::Key(key, action, _) => {
                    wishes.extend(self.keyboard.key(key, action).filter(|_| !is_typing));
                }
                WindowEvent::Char(sign) => {
                    wishes.extend(self.keyboard.sign(sign).filter(|_| !is_typing))
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
        if let (Some(at), Some(grab)) = (self.mouse(), &mut self.live.grab) {
            grab.follow(&lens.sight(at));
        }
        wishes
    }

    /// Begins to pull on the link under the mouse or near to it. If there is none, the camera turns.
    fn take(&mut self) {
        let (lens, stage, kinematics) =
            (self.lens(), &self.space.stage, &self.live.shown.kinematics);
        let Some(mouse) = self.mouse() else { return };
        if let Some(hit) = pick_near(stage, kinematics, &lens, mouse) {
            let grab = Grab::new(
                hit,
                &lens.sight(mouse),
                kinematics,
                lens.looking(),
                stage.scale,
            );
            self.live.take(grab);
            self.camera.rebind_rotate_button(None);
        }
    }

    fn let_go(&mut self) {
        self.live.let_go();
        self.camera.rebind_rotate_button(Some(MouseButton::Button1));
    }

    /// Simulates the time since the last frame.
    fn advance(&mut self) {
        let step_s = self.live.world.configs[0].control_period_s;
        self.clock.catch_up(step_s, || self.live.advance());
    }

    fn draw(&mut self, wishes: &mut Vec<Wish>) {
        let lens = self.lens();
        let eye = kiss3d::camera::Camera3d::eye(&self.camera);
        let marks = self.live.marks(&self.space.stage, &self.shown);
        let Simulation {
            now, kinematics, ..
        } = &self.live.shown;
        let has_body = self.shown.contains(&Overlay::Body);
        self.space
            .draw(now, kinematics, has_body, &marks, eye, &mut self.window);
        let mouse = self
            .mouse()
            .filter(|_| !self.window.is_egui_capturing_mouse());
        // This begins a frame of egui, to which the context below then belongs.
        self.window.draw_ui(|_| {});
        let ctx = &self.window.egui_context().clone();
        let stage = &self.space.stage;
        let wide = ctx.content_rect().width() - panel::WIDTH;
        let free = Rect::from_min_max(Pos2::ZERO, pos2(wide, ctx.content_rect().bottom()));
        let painter = ctx
            .layer_painter(LayerId::background())
            .with_clip_rect(free);
        let drawn = Marks {
            painter,
            lens: &lens,
            ground: stage.ground(now),
            scale: stage.scale,
        };
        drawn.axes();
        drawn.aim(now, &self.aim);
        let eye = Point3::new(eye.x, eye.y, eye.z).cast();
        if let (false, Style::Body { opacity }) = (has_body, Overlay::Body.look().style) {
            let paint = |solid: &Surface, _: &Isometry3<f64>| (colors::of(solid.color), opacity);
            let body = transparent::shape(stage, (kinematics, now.rope), paint, &lens, eye);
            drawn.painter.add(body);
        }
        if self.shown.contains(&Overlay::Trail) {
            drawn.trail(self.live.shown.trail.path(|at| at.com), Overlay::Com);
            drawn.trail(self.live.shown.trail.path(|at| at.dcm), Overlay::Dcm);
        }
        if let Some(ghost) = self
            .live
            .ghost
            .as_ref()
            .filter(|_| self.shown.contains(&Overlay::Ghost))
        {
            let paint = transparent::ghost(stage, (kinematics, now.rope));
            let other = (&ghost.kinematics, ghost.now.rope);
            let body = transparent::shape(stage, other, paint, &lens, eye);
            drawn.painter.add(body);
            drawn.faint(&stage.marks(&ghost.now, &self.of_ghost()));
        }
        for mark in &marks {
            drawn.draw(mark);
        }
        if let Some((at, name)) =
            mouse.and_then(|at| Some((at, self.live.link_at(stage, &lens, at)?)))
        {
            drawn.name(at, name);
        }
        if self.help {
            panel::help(ctx);
        }
        let Self {
            live,
            clock,
            shown,
            aim,
            ..
        } = &*self;
        let seen = Seen {
            live,
            clock,
            shown,
            aim: *aim,
            scale: stage.scale,
        };
        panel::draw(ctx, &seen, wishes);
    }

    /// The marks of a ghost, which are some of the shown marks.
    fn of_ghost(&self) -> Vec<Overlay> {
        GHOST_MARKS
            .into_iter()
            .filter(|overlay| self.shown.contains(overlay))
            .collect()
    }

    /// Fulfils a wish of the user.
    fn grant(&mut self, wish: Wish) {
        log::debug!("{wish:?}");
        match wish {
            Wish::Pause => self.clock.paused ^= true,
            Wish::Tick => {
                self.clock.paused = true;
                self.live.advance();
                self.live.counts.single_ticks += 1;
            }
            Wish::Restart => {
                self.live.restart();
                self.leash.jump(&mut self.camera, &self.live.shown.now.com);
            }
            Wish::Faster => self.clock.change_speed(true),
            Wish::Slower => self.clock.change_speed(false),
            Wish::Speed(speed) => self.clock.set_speed(speed),
            Wish::Push => self.live.push(self.aim.impulse_n_s, self.aim.heading_deg),
            Wish::Impulse(impulse_n_s) => self.aim.set_impulse(impulse_n_s),
            Wish::Harder(steps) => self.aim.harder(steps),
            Wish::Heading(turn_deg) => self.aim.turn(turn_deg),
            Wish::Controller(index) => self.live.switch_to(index),
            Wish::Toggle(overlay) => match self.shown.iter().position(|shown| *shown == overlay) {
                Some(i) => _ = self.shown.remove(i),
                None => self.shown.push(overlay),
            },
            Wish::ResetCamera => {
                (self.camera, self.leash) = (
                    camera(self.space.stage.scale),
                    Leash::of(self.space.stage.scale),
                );
                self.leash.jump(&mut self.camera, &self.live.shown.now.com);
            }
            Wish::Help => self.help ^= true,
            Wish::Quit => self.quits = true,
        }
    }

    /// Position of the mouse (points of egui).
    fn mouse(&self) -> Option<Pos2> {
        let scale = self.window.scale_factor();
        self.cursor
            .map(|(x, y)| pos2((x / scale) as f32, (y / scale) as f32))
    }

    fn lens(&self) -> Lens {
        let (size, scale) = (self.window.size(), self.window.scale_factor() as f32);
        Lens::new(
            &self.camera,
            egui::vec2(size.x as f32 / scale, size.y as f32 / scale),
        )
    }
}

fn write_picture(window: &Window, path: &Path) -> Result<()> {
    let written = window.snap_image().save(path);
    written.map_err(|e| Error::Write {
        path: path.into(),
        source: std::io::Error::other(e),
    })
}

/// A robot three times as long as the window is made for, of the same density.
#[cfg(test)]
const THRICE: standfast_core::robot::SizeRatio = standfast_core::robot::SizeRatio {
    length: 3.0,
    mass: 27.0,
};
