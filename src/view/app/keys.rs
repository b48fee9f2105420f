//! What a person can ask for, and by which keys.

use crate::report::palette::Overlay;
use kiss3d::event::Key;

/// One wish, from a key or from the panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wish {
    Pause,
    /// This many control ticks, back if negative; pauses.
    Ticks(i64),
    Restart,
    Faster,
    Slower,
    Speed(f64),
    Push,
    /// Of the next push, more or less (N s).
    Impulse(f64),
    /// Of the next push, turned (degrees).
    Heading(f64),
    /// The gain set with this number, from 0.
    GainSet(usize),
    Toggle(Overlay),
    /// To this time of a recording (s).
    Seek(f64),
    /// By so much time of a recording (s).
    Skip(f64),
    ResetCamera,
    Help,
    Quit,
}

/// Keys of a live view, and what they do.
pub const LIVE_HELP: [(&str, &str); 12] = [
    ("drag on robot", "pull that link"),
    ("drag, right drag", "orbit, pan; wheel zooms"),
    ("space", "pause, go on"),
    (". or N", "one control tick"),
    ("- +", "slower, faster"),
    ("R", "restart"),
    ("Enter", "push"),
    ("up down", "impulse of the push"),
    ("left right", "heading of the push"),
    ("1 2 3 ...", "gain set"),
    ("V", "camera as at the start"),
    ("H, Q or Esc", "this help, quit"),
];

/// Keys of a recording.
pub const RECORDED_HELP: [(&str, &str); 8] = [
    ("drag, right drag", "orbit, pan; wheel zooms"),
    ("space", "play, pause"),
    (". ,", "a control tick on, back"),
    ("left right", "0.1 s back, on"),
    ("Home, End", "first, last moment"),
    ("- +", "slower, faster"),
    ("V", "camera as at the start"),
    ("H, Q or Esc", "this help, quit"),
];

const DIGITS: [Key; 9] =
    [Key::Key1, Key::Key2, Key::Key3, Key::Key4, Key::Key5, Key::Key6, Key::Key7, Key::Key8, Key::Key9];
/// Of the overlays, in their order.
const LETTERS: [Key; Overlay::ALL.len()] = [Key::C, Key::D, Key::Z, Key::W, Key::S, Key::I, Key::F, Key::G, Key::P];

/// What a key asks for, live or of a recording.
pub fn wish(key: Key, live: bool) -> Option<Wish> {
    if let Some(i) = LETTERS.iter().position(|&letter| letter == key) {
        return Some(Wish::Toggle(Overlay::ALL[i]));
    }
    let shared = match key {
        Key::Space => Wish::Pause,
        Key::Period | Key::N => Wish::Ticks(1),
        Key::Minus | Key::Subtract => Wish::Slower,
        Key::Equals | Key::Add => Wish::Faster,
        Key::V => Wish::ResetCamera,
        Key::H => Wish::Help,
        Key::Q | Key::Escape => Wish::Quit,
        _ => return if live { live_wish(key) } else { recorded_wish(key) },
    };
    Some(shared)
}

fn live_wish(key: Key) -> Option<Wish> {
    if let Some(i) = DIGITS.iter().position(|&digit| digit == key) {
        return Some(Wish::GainSet(i));
    }
    Some(match key {
        Key::R => Wish::Restart,
        Key::Return | Key::NumpadEnter => Wish::Push,
        Key::Up => Wish::Impulse(0.1),
        Key::Down => Wish::Impulse(-0.1),
        // Headings turn to the left.
        Key::Left => Wish::Heading(15.0),
        Key::Right => Wish::Heading(-15.0),
        _ => return None,
    })
}

fn recorded_wish(key: Key) -> Option<Wish> {
    Some(match key {
        Key::Comma => Wish::Ticks(-1),
        Key::Left => Wish::Skip(-0.1),
        Key::Right => Wish::Skip(0.1),
        Key::Home | Key::R => Wish::Seek(0.0),
        Key::End => Wish::Seek(f64::INFINITY),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keys_of_overlays_are_those_in_their_list() {
        for (letter, overlay) in LETTERS.into_iter().zip(Overlay::ALL) {
            assert_eq!(format!("{letter:?}").to_lowercase(), overlay.look().key.to_string());
            assert_eq!(wish(letter, true), Some(Wish::Toggle(overlay)));
            assert_eq!(wish(letter, false), Some(Wish::Toggle(overlay)));
        }
    }

    #[test]
    fn a_recording_is_neither_pushed_nor_switched() {
        for key in [Key::Return, Key::Up, Key::Key1] {
            assert!(wish(key, true).is_some() && wish(key, false).is_none(), "{key:?}");
        }
        assert_eq!((wish(Key::Key3, true), wish(Key::Comma, true)), (Some(Wish::GainSet(2)), None));
    }
}
