//! The wishes of the user, and the keys for them.

use kiss3d::event::{Action, Key};
use standfast_scene::palette::{GHOST, Overlay};
use std::time::{Duration, Instant};

/// A wish of the user, from a key or from the panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wish {
    Pause,
    /// Pauses, and continues by one control tick.
    Tick,
    Restart,
    Faster,
    Slower,
    Speed(f64),
    Push,
    /// Impulse of the next push (N s).
    Impulse(f64),
    /// Makes the next push harder by this many steps, or softer if negative.
    Harder(i32),
    /// Turns the next push to the left (degrees).
    Heading(f64),
    /// Chooses the controller with this number, from 0.
    Controller(usize),
    Toggle(Overlay),
    ToggleGhost,
    ResetCamera,
    Help,
    Quit,
}

impl Wish {
    /// Whether a key that is held repeats the wish.
    fn repeats(self) -> bool {
        use Wish::{Faster, Harder, Heading, Slower, Tick};
        matches!(self, Tick | Harder(_) | Heading(_) | Faster | Slower)
    }
}

/// The help on mouse and keys.
pub const HELP: [(&str, &str); 14] = [
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
    ("1, 2, 3 ...", "choose the controller of the solid robot"),
    ("V", "returns to the first view"),
    ("E", "shows and hides the ghost"),
    ("H; Q or Esc", "hides this help; quits"),
];

/// Longest time between the repeated presses of a key that is held. After a longer time the key was released while
/// another window had the keyboard, and this window did not get the event.
const LONGEST_REPEAT: Duration = Duration::from_secs(3);

/// The keys that are down. The window reports a press first as the place of the key, then as the character that the key
/// has on the user's keyboard. Letters and signs are recognised by the character; digits and keys with a name by the
/// place.
#[derive(Debug, Default)]
pub struct Keyboard {
    /// The keys that are down, each with the time of its last press.
    down: Vec<(Key, Instant)>,
    /// The key whose character comes next, and whether it was held before.
    struck: Option<(Key, bool)>,
}

impl Keyboard {
    /// The wish of a key that goes down or up, if the key has a name.
    pub fn key(&mut self, key: Key, action: Action) -> Option<Wish> {
        let before = self
            .down
            .iter()
            .position(|(down, _)| *down == key)
            .map(|i| self.down.swap_remove(i).1);
        if action == Action::Release {
            self.struck = None;
            return None;
        }
        let is_held = before.is_some_and(|last| last.elapsed() < LONGEST_REPEAT);
        self.down.push((key, Instant::now()));
        self.struck = Some((key, is_held));
        named(key).filter(|wish| !is_held || wish.repeats())
    }

    /// The wish of the character of the key that was pressed.
    pub fn sign(&mut self, sign: char) -> Option<Wish> {
        let (key, is_held) = self.struck.take()?;
        // On a keyboard without Latin letters, keys are recognised by their place.
        let sign = if sign.is_ascii() {
            Some(sign.to_ascii_lowercase())
        } else {
            in_place(key)
        };
        sign.and_then(signed)
            .or_else(|| {
                let index = in_place(key)?.to_digit(10)?.checked_sub(1)?;
                Some(Wish::Controller(index as usize))
            })
            .filter(|wish| !is_held || wish.repeats())
    }
}

fn named(key: Key) -> Option<Wish> {
    Some(match key {
        Key::Space => Wish::Pause,
        Key::Escape => Wish::Quit,
        Key::Return | Key::NumpadEnter => Wish::Push,
        Key::Up => Wish::Harder(1),
        Key::Down => Wish::Harder(-1),
        // A larger heading is farther to the left.
        Key::Left => Wish::Heading(15.0),
        Key::Right => Wish::Heading(-15.0),
        _ => return None,
    })
}

/// The wish of a letter (lower case) or another sign.
fn signed(sign: char) -> Option<Wish> {
    if let Some(overlay) = Overlay::ALL
        .into_iter()
        .find(|overlay| overlay.look().key == sign)
    {
        return Some(Wish::Toggle(overlay));
    }
    Some(match sign {
        key if key == GHOST.key => Wish::ToggleGhost,
        '.' | 'n' => Wish::Tick,
        '-' => Wish::Slower,
        '=' | '+' => Wish::Faster,
        'v' => Wish::ResetCamera,
        'h' => Wish::Help,
        'q' => Wish::Quit,
        'r' => Wish::Restart,
        _ => return None,
    })
}

/// The letter, digit or sign of a key on a keyboard of the United States.
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

    /// The wishes of a press after which the key stays down.
    fn press(keyboard: &mut Keyboard, key: Key, sign: char) -> Vec<Wish> {
        let named = keyboard.key(key, Action::Press);
        named.into_iter().chain(keyboard.sign(sign)).collect()
    }

    #[test]
    fn every_overlay_has_a_key_of_its_own() {
        for (i, overlay) in Overlay::ALL.into_iter().enumerate() {
            let key = overlay.look().key;
            assert_eq!(signed(key), Some(Wish::Toggle(Overlay::ALL[i])));
            assert!(!".n-=+vhqr".contains(key), "{key} does something else too");
        }
        assert_eq!(signed(GHOST.key), Some(Wish::ToggleGhost));
    }

    #[test]
    fn a_held_key_repeats_only_some_wishes() {
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
            let mut count = || press(&mut keyboard, key, sign).len();
            assert_eq!(
                [count(), count(), count()],
                if repeats { [1, 1, 1] } else { [1, 0, 0] },
                "{key:?}"
            );
            keyboard.key(key, Action::Release);
            assert_eq!(press(&mut keyboard, key, sign).len(), 1, "{key:?} again");
            // The key was released, and the window did not get the event.
            keyboard.down[0].1 -= LONGEST_REPEAT;
            assert_eq!(
                press(&mut keyboard, key, sign).len(),
                1,
                "{key:?} another time"
            );
        }
    }

    #[test]
    fn letters_and_signs_go_by_what_is_printed_on_the_keys() {
        let french = [
            // A is where other keyboards have Q, and Q where they have A.
            (Key::Q, 'a', None),
            (Key::A, 'q', Some(Wish::Quit)),
            (Key::Key6, '-', Some(Wish::Slower)),
            (Key::Key1, '&', Some(Wish::Controller(0))),
            (Key::Key2, '\u{e9}', Some(Wish::Controller(1))),
            (Key::Comma, ';', None),
        ];
        let others = [
            (Key::Equals, '+', Some(Wish::Faster)),
            (Key::H, 'H', Some(Wish::Help)),
            // These are Cyrillic letters.
            (Key::Q, '\u{439}', Some(Wish::Quit)),
            (Key::Period, '\u{44e}', Some(Wish::Tick)),
        ];
        for (key, sign, expected) in french.into_iter().chain(others) {
            assert_eq!(
                press(&mut Keyboard::default(), key, sign),
                Vec::from_iter(expected),
                "{key:?} {sign}"
            );
        }
    }
}
