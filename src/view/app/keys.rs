//! What a person can ask for, and by which keys.

use crate::render::scene::palette::Overlay;
use kiss3d::event::{Action, Key};
use std::time::{Duration, Instant};

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
    /// Of the next push (N s).
    Impulse(f64),
    /// Of the next push, harder by so many steps, softer if negative.
    Harder(i32),
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

impl Wish {
    /// Whether a key that is held asks for it again and again.
    fn repeats(self) -> bool {
        use Wish::{Faster, Harder, Heading, Skip, Slower, Ticks};
        matches!(self, Ticks(_) | Harder(_) | Heading(_) | Skip(_) | Faster | Slower)
    }
}

/// What mouse and keys do in a live view.
pub const LIVE_HELP: [(&str, &str); 13] = [
    ("drag the robot", "pulls the link under the mouse"),
    ("drag elsewhere", "turns the view; right drag moves it"),
    ("wheel", "zooms"),
    ("Space", "pauses and goes on"),
    (". or N", "goes on by one control tick"),
    ("- and +", "slower and faster"),
    ("R", "restarts"),
    ("Enter", "pushes the robot"),
    ("Up, Down", "change the impulse of the push"),
    ("Left, Right", "turn the push"),
    ("1, 2, 3 ...", "choose the gain set"),
    ("V", "returns to the first view"),
    ("H; Q or Esc", "hides this help; quits"),
];

/// And in a recording.
pub const RECORDED_HELP: [(&str, &str); 9] = [
    ("drag", "turns the view; right drag moves it"),
    ("wheel", "zooms"),
    ("Space", "plays and pauses"),
    (", and .", "go by one control tick, back and on"),
    ("Left, Right", "go by 0.1 s, back and on"),
    ("Home, End", "go to the first and the last moment"),
    ("- and +", "slower and faster"),
    ("V", "returns to the first view"),
    ("H; Q or Esc", "hides this help; quits"),
];

/// A key that is held is pressed again sooner than this. One that was let go where the window was not told of it
/// (another one had the keyboard) is not.
const LONGEST_REPEAT: Duration = Duration::from_secs(3);

/// The keys that are down. A press is told as the place of a key, and then as the sign that it has there: letters and
/// signs go by what is printed on the person's keyboard, what has a name and the digits by their place.
#[derive(Debug, Default)]
pub struct Keyboard {
    /// Each with its last press.
    down: Vec<(Key, Instant)>,
    /// The key whose sign comes next; whether it was held already.
    struck: Option<(Key, bool)>,
}

impl Keyboard {
    /// A key goes down, or up: what it asks for by its name, live or of a recording.
    pub fn key(&mut self, key: Key, action: Action, live: bool) -> Option<Wish> {
        let before = self.down.iter().position(|(down, _)| *down == key).map(|i| self.down.swap_remove(i).1);
        if action == Action::Release {
            self.struck = None;
            return None;
        }
        let is_held = before.is_some_and(|last| last.elapsed() < LONGEST_REPEAT);
        self.down.push((key, Instant::now()));
        self.struck = Some((key, is_held));
        named(key, live).filter(|wish| !is_held || wish.repeats())
    }

    /// The sign of the key that was pressed: what it asks for.
    pub fn sign(&mut self, sign: char, live: bool) -> Option<Wish> {
        let (key, is_held) = self.struck.take()?;
        // Where letters are not Latin their keys are known by their place.
        let sign = if sign.is_ascii() { Some(sign.to_ascii_lowercase()) } else { in_place(key) };
        let digit = || in_place(key)?.to_digit(10)?.checked_sub(1).filter(|_| live).map(|i| Wish::GainSet(i as usize));
        sign.and_then(|sign| signed(sign, live)).or_else(digit).filter(|wish| !is_held || wish.repeats())
    }
}

/// What a key that has a name asks for.
fn named(key: Key, live: bool) -> Option<Wish> {
    Some(match (key, live) {
        (Key::Space, _) => Wish::Pause,
        (Key::Escape, _) => Wish::Quit,
        (Key::Return | Key::NumpadEnter, true) => Wish::Push,
        (Key::Up, true) => Wish::Harder(1),
        (Key::Down, true) => Wish::Harder(-1),
        // Headings turn to the left.
        (Key::Left, true) => Wish::Heading(15.0),
        (Key::Right, true) => Wish::Heading(-15.0),
        (Key::Left, false) => Wish::Skip(-0.1),
        (Key::Right, false) => Wish::Skip(0.1),
        (Key::Home, false) => Wish::Seek(0.0),
        (Key::End, false) => Wish::Seek(f64::INFINITY),
        _ => return None,
    })
}

/// What a letter (lower case) or another sign asks for.
fn signed(sign: char, live: bool) -> Option<Wish> {
    if let Some(overlay) = Overlay::ALL.into_iter().find(|overlay| overlay.look().key == sign) {
        return Some(Wish::Toggle(overlay));
    }
    Some(match (sign, live) {
        ('.' | 'n', _) => Wish::Ticks(1),
        (',', false) => Wish::Ticks(-1),
        ('-', _) => Wish::Slower,
        ('=' | '+', _) => Wish::Faster,
        ('v', _) => Wish::ResetCamera,
        ('h', _) => Wish::Help,
        ('q', _) => Wish::Quit,
        ('r', true) => Wish::Restart,
        ('r', false) => Wish::Seek(0.0),
        _ => return None,
    })
}

/// The letter, digit or sign of a key where its keyboard is that of the United States.
fn in_place(key: Key) -> Option<char> {
    match key {
        Key::Period => Some('.'),
        Key::Comma => Some(','),
        Key::Minus => Some('-'),
        Key::Equals => Some('='),
        _ => {
            let name = format!("{key:?}").to_ascii_lowercase();
            name.strip_prefix("key").unwrap_or(&name).parse().ok()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a press asks for; the key stays down.
    fn press(keyboard: &mut Keyboard, key: Key, sign: Option<char>, live: bool) -> Vec<Wish> {
        let named = keyboard.key(key, Action::Press, live);
        named.into_iter().chain(sign.and_then(|sign| keyboard.sign(sign, live))).collect()
    }

    fn once(key: Key, sign: Option<char>, live: bool) -> Vec<Wish> {
        press(&mut Keyboard::default(), key, sign, live)
    }

    #[test]
    fn every_overlay_has_a_key_of_its_own() {
        for (i, overlay) in Overlay::ALL.into_iter().enumerate() {
            let key = overlay.look().key;
            for live in [true, false] {
                assert_eq!(signed(key, live), Some(Wish::Toggle(Overlay::ALL[i])));
            }
            assert!(!".n,-=+vhqr".contains(key), "{key} does something else too");
        }
    }

    #[test]
    fn a_recording_is_neither_pushed_nor_switched() {
        for (key, sign) in [(Key::Return, '\r'), (Key::Up, '\0'), (Key::Key1, '1')] {
            let asked = |live| once(key, Some(sign), live).len();
            assert_eq!((asked(true), asked(false)), (1, 0), "{key:?}");
        }
        let third = once(Key::Key3, Some('3'), true);
        assert_eq!((third, once(Key::Comma, Some(','), true)), (vec![Wish::GainSet(2)], vec![]));
    }

    #[test]
    fn a_key_that_is_held_does_once_what_is_done_once() {
        for (key, sign, repeats) in [
            (Key::Return, '\r', false),
            (Key::Space, ' ', false),
            (Key::R, 'r', false),
            (Key::C, 'c', false),
            (Key::Key2, '2', false),
            (Key::Period, '.', true),
            (Key::Minus, '-', true),
            (Key::Up, '\0', true),
            (Key::Left, '\0', true),
        ] {
            let mut keyboard = Keyboard::default();
            let mut count = || press(&mut keyboard, key, Some(sign), true).len();
            assert_eq!([count(), count(), count()], if repeats { [1, 1, 1] } else { [1, 0, 0] }, "{key:?}");
            keyboard.key(key, Action::Release, true);
            assert_eq!(press(&mut keyboard, key, Some(sign), true).len(), 1, "{key:?} again");
            // It was let go, and nobody told.
            keyboard.down[0].1 -= LONGEST_REPEAT;
            assert_eq!(press(&mut keyboard, key, Some(sign), true).len(), 1, "{key:?} another time");
        }
    }

    #[test]
    fn letters_and_signs_go_by_what_is_printed_on_the_keys() {
        let french = [
            // A where others have Q, and Q where they have A.
            (Key::Q, 'a', None),
            (Key::A, 'q', Some(Wish::Quit)),
            (Key::Key6, '-', Some(Wish::Slower)),
            (Key::Key1, '&', Some(Wish::GainSet(0))),
            (Key::Key2, '\u{e9}', Some(Wish::GainSet(1))),
            (Key::Comma, ';', None),
        ];
        let others = [
            (Key::Equals, '+', Some(Wish::Faster)),
            (Key::H, 'H', Some(Wish::Help)),
            // Cyrillic.
            (Key::Q, '\u{439}', Some(Wish::Quit)),
            (Key::Period, '\u{44e}', Some(Wish::Ticks(1))),
        ];
        for (key, sign, expected) in french.into_iter().chain(others) {
            assert_eq!(once(key, Some(sign), true), Vec::from_iter(expected), "{key:?} {sign}");
        }
    }
}
