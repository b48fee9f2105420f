//! The time line of a recording: its phases and events, and the moment that is shown.

use super::colors;
use super::keys::Wish;
use super::recorded::Recorded;
use crate::control::Phase;
use crate::render::scene::palette::{Color, GHOST, Overlay};
use crate::render::scene::{Event, EventKind, events};
use kiss3d::egui::{Align2, Area, Color32, Context, FontId, Frame, Id, Margin, Rect, Sense, Stroke, Ui, pos2, vec2};

/// Height of the time line (points).
const HEIGHT: f32 = 34.0;

/// Draws the time line along the lower edge, `width` points long, and adds the wishes of the user.
pub fn draw(ctx: &Context, recorded: &Recorded, paused: bool, width: f32, wishes: &mut Vec<Wish>) {
    let frame = Frame::NONE.fill(Color32::from_white_alpha(225)).inner_margin(Margin::symmetric(12, 8));
    Area::new(Id::new("time line")).anchor(Align2::LEFT_BOTTOM, vec2(0.0, 0.0)).show(ctx, |ui| {
        frame.show(ui, |ui| {
            ui.set_width(width - 24.0);
            ui.horizontal(|ui| {
                let pause = if paused { "Play" } else { "Pause" };
                for (name, hint, wish) in [
                    (pause, "plays and pauses (Space)", Wish::Pause),
                    ("<", "goes back by one tick (,)", Wish::Ticks(-1)),
                    (">", "goes on by one tick (.)", Wish::Ticks(1)),
                ] {
                    wishes.extend(ui.button(name).on_hover_text(hint).clicked().then_some(wish));
                }
                let time = format!("{:.3} of {:.2} s", recorded.now().time_s, recorded.end_s());
                ui.monospace(time);
                line(ui, recorded, wishes);
            });
        });
    });
}

fn color(phase: Phase) -> Color {
    match phase {
        Phase::Posture => colors::GRID,
        Phase::Switching => Overlay::Slices.color().towards(colors::FLOOR, 0.5),
        Phase::OutOfSets => Overlay::ZmpRef.color(),
        Phase::Swing(_) => Overlay::Footstep.color(),
    }
}

/// Draws phases, events and the present moment. A click or a drag is a wish to go to that time.
fn line(ui: &mut Ui, recorded: &Recorded, wishes: &mut Vec<Wish>) {
    let (area, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let painter = ui.painter();
    let end_s = recorded.end_s().max(1e-9);
    let x = |time_s: f64| area.left() + (time_s / end_s) as f32 * area.width();
    let bar = Rect::from_x_y_ranges(area.x_range(), area.top() + 4.0..=area.top() + 18.0);
    let block = |from_s: f64, to_s: f64| Rect::from_x_y_ranges(x(from_s)..=x(to_s), bar.y_range());
    // There is one block for each uninterrupted phase.
    let film = &recorded.shown.film;
    let snapshots = &film.snapshots;
    let mut from = 0;
    for i in 1..=snapshots.len() {
        if i == snapshots.len() || snapshots[i].phase != snapshots[from].phase {
            let to_s = snapshots[i.min(snapshots.len() - 1)].time_s;
            painter.rect_filled(block(snapshots[from].time_s, to_s), 0, color(snapshots[from].phase).egui());
            from = i;
        }
    }
    // Left end of the free space: the texts of events stand side by side.
    let mut free_x = area.left();
    let mut mark = |at_s: f64, text: &str, color: Color| {
        let words = painter.layout_no_wrap(text.into(), FontId::proportional(11.0), color.egui());
        let width = words.size().x;
        let left = (x(at_s) - width / 2.0).min(area.right() - width).max(free_x);
        free_x = left + width + 6.0;
        painter.galley(pos2(left, bar.bottom() + 2.0), words, color.egui());
        painter.vline(x(at_s), bar.y_range(), Stroke::new(1.5, color.egui()));
    };
    for Event { kind, from_s, to_s, text } in events(film, snapshots, recorded.ghost.as_ref().map(|ghost| &ghost.film))
    {
        match kind {
            EventKind::Push => {
                painter.rect_filled(block(from_s, to_s.min(end_s)), 0, colors::PUSH.egui());
                mark(from_s, &text, colors::PUSH);
            }
            EventKind::Legs => mark(from_s, "legs met", colors::PUSH),
            EventKind::Fall => mark(from_s, &text, colors::INK),
            EventKind::Still => mark(from_s, "still", colors::WELL),
            EventKind::Parting => mark(from_s, "ghost parts", GHOST.color),
            // Switches and footsteps are seen by the colours of the phases.
            EventKind::Switch | EventKind::Footstep => {}
        }
    }
    let now = x(recorded.now().time_s);
    painter.vline(now, area.top()..=bar.bottom() + 3.0, Stroke::new(2.0, colors::INK.egui()));
    painter.circle_filled(pos2(now, area.top() + 3.0), 5.0, colors::INK.egui());
    if let Some(at) = response.interact_pointer_pos() {
        let share = f64::from((at.x - area.left()) / area.width()).clamp(0.0, 1.0);
        wishes.push(Wish::Seek(share * end_s));
    }
}
