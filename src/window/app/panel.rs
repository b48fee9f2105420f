//! The panel at the right: the state of controller and robot, and controls for all actions of the keys.

use super::aim::Aim;
use super::clock::{FrameClock, SPEEDS};
use super::colors::OnScreen as _;
use super::keys::{HELP, Wish};
use super::live::Live;
use super::{colors, plots, space};
use kiss3d::egui::{
    Align2, Area, Button, Color32, Context, DragValue, Frame, Grid, Id, Margin, RichText,
    ScrollArea, Sense, Ui, vec2,
};
use standfast_core::robot::SizeRatio;
use standfast_scene::palette::{GHOST, Overlay, OverlayLook};
use standfast_scene::{doing, without_gain};

/// Width of the panel (points).
pub const WIDTH: f32 = 340.0;
/// Height of a line of text with the space after it (points).
const LINE: f32 = 22.0;
/// Smallest height of a plot (points). If two plots do not fit, the panel scrolls.
const LEAST_PLOT: f32 = 80.0;

/// The data that the panel shows.
pub struct Seen<'a> {
    pub live: &'a Live<'a>,
    pub clock: &'a FrameClock,
    pub shown: &'a [Overlay],
    pub shows_ghost: bool,
    pub aim: Aim,
    pub scale: SizeRatio,
}

/// Draws the panel, and adds the wishes of the user.
pub fn draw(ctx: &Context, seen: &Seen, wishes: &mut Vec<Wish>) {
    let height = ctx.content_rect().height();
    let frame = Frame::NONE
        .fill(Color32::from_rgb(0xf8, 0xf9, 0xfb))
        .inner_margin(Margin::same(12));
    Area::new(Id::new("panel"))
        .anchor(Align2::RIGHT_TOP, vec2(0.0, 0.0))
        .show(ctx, |ui| {
            frame.show(ui, |ui| {
                ui.set_width(WIDTH - 24.0);
                ui.set_max_width(WIDTH - 24.0);
                ui.set_height(height - 24.0);
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    let (live, scale) = (seen.live, seen.scale);
                    state(ui, live, wishes);
                    ui.separator();
                    time(ui, seen, wishes);
                    push(ui, seen.aim, wishes);
                    ui.separator();
                    overlays(ui, seen, wishes);
                    ui.separator();
                    // Both plots, their names and the last line fill the rest of the window.
                    let height = (0.5 * (ui.available_height() - 3.0 * LINE)).max(LEAST_PLOT);
                    let ghost = live
                        .ghost
                        .as_ref()
                        .filter(|_| seen.shows_ghost)
                        .map(|ghost| &ghost.trail);
                    plots::draw(
                        ui,
                        &live.shown.trail,
                        ghost,
                        scale.length,
                        live.shown.now.time_s,
                        height,
                    );
                    ui.horizontal(|ui| {
                        for (name, wish) in [
                            ("Keys (H)", Wish::Help),
                            ("First view (V)", Wish::ResetCamera),
                        ] {
                            if ui.small_button(name).clicked() {
                                wishes.push(wish);
                            }
                        }
                        ui.weak(format!(
                            "{}; floor lines: {} m",
                            live.shown.config.engine.title(),
                            space::spacing_m(scale)
                        ));
                    });
                });
            });
        });
}

/// The controllers, the verdict, and the state of the controller.
fn state(ui: &mut Ui, live: &Live, wishes: &mut Vec<Wish>) {
    let (factories, acting) = (&live.world.factories, live.shown.acting);
    ui.horizontal_wrapped(|ui| {
        for i in 0..factories.len() {
            let name = format!("{} {}", i + 1, live.controller(i));
            if ui.selectable_label(i == acting, name).clicked() {
                wishes.push(Wish::Controller(i));
            }
        }
    });
    for (which, robot) in live.robots() {
        let (verdict, badly) = live.verdict_on(robot);
        let color = if badly { colors::BADLY } else { colors::WELL };
        let verdict = match live.ghost {
            Some(_) => format!("{which}, {}: {verdict}", live.entrant(robot)),
            None => verdict,
        };
        ui.label(RichText::new(verdict).color(color.egui()).strong());
    }
    let now = &live.shown.now;
    Grid::new("state")
        .num_columns(2)
        .spacing([10.0, 3.0])
        .show(ui, |ui| {
            ui.label("gain");
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 6.0;
                let Some(of_now) = &now.gain else {
                    ui.label(without_gain(&now.phase));
                    return;
                };
                // The gains are in the order from slow to fast.
                for name in &factories[acting].regions {
                    match name == of_now {
                        true => ui.label(
                            RichText::new(format!(" {name} "))
                                .color(Color32::WHITE)
                                .background_color(Overlay::Slices.color().egui()),
                        ),
                        false => ui.weak(name),
                    };
                }
            });
            ui.end_row();
            ui.label("phase");
            ui.label(doing(&now.phase));
            ui.end_row();
            ui.label("margin");
            match now.margin {
                Some(margin) => ui.label(format!("{margin:.2}  (1 at rest, negative outside)")),
                None => ui.label("none"),
            };
            ui.end_row();
            ui.label("DCM");
            let mm = 1000.0 * now.dcm_outside_m;
            ui.label(match mm {
                mm if mm.is_infinite() => "no support".to_string(),
                mm if mm > 0.0 => format!("{mm:.0} mm outside the support"),
                mm => format!("{:.0} mm inside the support", -mm),
            });
            ui.end_row();
        });
}

/// The time, the measured speed, and their controls.
fn time(ui: &mut Ui, seen: &Seen, wishes: &mut Vec<Wish>) {
    let clock = seen.clock;
    ui.horizontal_wrapped(|ui| {
        ui.monospace(RichText::new(format!("{:.3} s", seen.live.shown.now.time_s)).size(16.0));
        let (text, slow) = match clock.factor {
            None if clock.paused => ("paused".to_string(), false),
            None => (String::new(), false),
            Some(factor) => {
                let late = factor < 0.9 * clock.speed;
                let late_words = if late { "physics is slow: " } else { "" };
                (
                    format!(
                        "{late_words}{factor:.2} of real time, {:.0} frames/s",
                        clock.frames_per_s
                    ),
                    late,
                )
            }
        };
        ui.label(if slow {
            RichText::new(text).color(colors::BADLY.egui())
        } else {
            RichText::new(text).weak()
        });
    });
    ui.horizontal(|ui| {
        let pause = if clock.paused { "Go on" } else { "Pause" };
        for (name, wish) in [
            (pause, Wish::Pause),
            ("Tick", Wish::Tick),
            ("Restart", Wish::Restart),
        ] {
            if ui.button(name).clicked() {
                wishes.push(wish);
            }
        }
    });
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.label("speed ");
        for speed in SPEEDS {
            let name = if speed < 1.0 {
                format!("1/{:.0}", 1.0 / speed)
            } else {
                format!("{speed:.0}")
            };
            let is_chosen = (clock.speed / speed - 1.0).abs() < 1e-6;
            if ui.selectable_label(is_chosen, name).clicked() {
                wishes.push(Wish::Speed(speed));
            }
        }
    });
}

/// The button that pushes, with impulse and heading.
fn push(ui: &mut Ui, aim: Aim, wishes: &mut Vec<Wish>) {
    ui.horizontal(|ui| {
        let button =
            Button::new(RichText::new("Push").color(Color32::WHITE)).fill(colors::PUSH.egui());
        if ui.add(button).clicked() {
            wishes.push(Wish::Push);
        }
        let (mut impulse, mut heading) = (aim.impulse_n_s, aim.heading_deg);
        let speed = 0.2 * aim.step_n_s;
        let dragged = ui.add(
            DragValue::new(&mut impulse)
                .speed(speed)
                .fixed_decimals(2)
                .suffix(" N s"),
        );
        if dragged.changed() {
            wishes.push(Wish::Impulse(impulse));
        }
        ui.label("to");
        let dragged = ui.add(
            DragValue::new(&mut heading)
                .speed(1.0)
                .fixed_decimals(0)
                .suffix(" deg"),
        );
        if dragged.changed() {
            wishes.push(Wish::Heading(heading - aim.heading_deg));
        }
        ui.weak("0 forward, 90 left");
    });
}

/// The check boxes of the overlays.
fn overlays(ui: &mut Ui, seen: &Seen, wishes: &mut Vec<Wish>) {
    let mut boxes = Vec::new();
    for overlay in Overlay::ALL {
        let OverlayLook {
            key,
            name,
            hint,
            color,
            ..
        } = overlay.look();
        boxes.push((
            name.to_string(),
            key,
            hint,
            color,
            seen.shown.contains(&overlay),
            Wish::Toggle(overlay),
        ));
    }
    if let Some(ghost) = &seen.live.ghost {
        let (name, hint) = (format!("ghost: {}", seen.live.entrant(ghost)), GHOST.hint);
        boxes.push((
            name,
            GHOST.key,
            hint,
            GHOST.color,
            seen.shows_ghost,
            Wish::ToggleGhost,
        ));
    }
    Grid::new("overlays")
        .num_columns(2)
        .spacing([8.0, 2.0])
        .show(ui, |ui| {
            for (i, (name, key, hint, color, mut is_shown, wish)) in boxes.into_iter().enumerate() {
                ui.horizontal(|ui| {
                    let (place, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
                    ui.painter().rect_filled(place, 2, color.egui());
                    let switch = ui.checkbox(
                        &mut is_shown,
                        format!("{name} ({})", key.to_ascii_uppercase()),
                    );
                    if switch.on_hover_text(hint).changed() {
                        wishes.push(wish);
                    }
                });
                if i % 2 == 1 {
                    ui.end_row();
                }
            }
        });
}

/// The help on keys, at the upper left of the picture.
pub fn help(ctx: &Context) {
    let frame = Frame::NONE
        .fill(Color32::from_white_alpha(210))
        .corner_radius(6)
        .inner_margin(Margin::same(8));
    Area::new(Id::new("keys"))
        .anchor(Align2::LEFT_TOP, vec2(10.0, 10.0))
        .interactable(false)
        .show(ctx, |ui| {
            frame.show(ui, |ui| {
                Grid::new("keys")
                    .num_columns(2)
                    .spacing([10.0, 0.0])
                    .min_row_height(15.0)
                    .show(ui, |ui| {
                        for (key, what) in HELP {
                            ui.label(RichText::new(key).size(11.5).strong());
                            ui.label(RichText::new(what).size(11.5));
                            ui.end_row();
                        }
                    });
            });
        });
}
