//! Makes texts of others harmless: names in files, answers and error messages of programs, metadata of networks. All
//! text that is printed or drawn goes through here, so that it cannot command a terminal or break a page.

use std::borrow::Cow;

/// Largest number of digits of a number that is not shortened: `1e308` written out has 309.
const MOST_DIGITS: usize = 40;

/// The text with escapes such as `\u001b`, as in JSON, for control characters and for characters that change the
/// direction of writing. Line breaks and tabs stay. Numbers of more than 40 digits are shortened to the form `1e308`.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let text = match text.contains(is_harmful) {
        true => {
            let mut out = String::new();
            for c in text.chars() {
                match is_harmful(c) {
                    true => out += &format!("\\u{:04x}", u32::from(c)),
                    false => out.push(c),
                }
            }
            Cow::Owned(out)
        }
        false => Cow::Borrowed(text),
    };
    match shortened(&text) {
        Some(short) => Cow::Owned(short),
        None => text,
    }
}

/// Whether a character has an effect beyond its picture, or is not allowed in XML.
fn is_harmful(c: char) -> bool {
    let turns = matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control() && c != '\n' && c != '\t' || turns || matches!(c, '\u{fffe}' | '\u{ffff}')
}

/// The text with its long numbers shortened; None if there are none.
fn shortened(text: &str) -> Option<String> {
    let digits = |from: usize| {
        text.as_bytes()[from..]
            .iter()
            .take_while(|byte| byte.is_ascii_digit())
            .count()
    };
    let (mut short, mut kept, mut at) = (None, 0, 0);
    while let Some(from) = text.as_bytes()[at..]
        .iter()
        .position(u8::is_ascii_digit)
        .map(|ahead| at + ahead)
    {
        at = from + digits(from);
        if text[at..].starts_with('.') {
            at += 1 + digits(at + 1);
        }
        if let (true, Ok(number)) = (at - from > MOST_DIGITS, text[from..at].parse::<f64>()) {
            let out: &mut String = short.get_or_insert_default();
            *out += &text[kept..from];
            *out += &format!("{number:e}");
            kept = at;
        }
    }
    short.map(|out| out + &text[kept..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_is_a_picture_of_the_text() {
        for plain in [
            "",
            "catch recovers\n\tin 96.4 % of 1000 trials: é, µ, 日本",
            "0.0001 and 1234567890.5",
            "1.2.3.",
        ] {
            assert!(
                matches!(harmless(plain), Cow::Borrowed(same) if same == plain),
                "{plain}"
            );
        }
        for (text, shown) in [
            ("a\u{1b}]0;pwned\u{7}b", r"a\u001b]0;pwned\u0007b"),
            (
                "100 %\rfell \u{9b}2J \u{7f} \0",
                r"100 %\u000dfell \u009b2J \u007f \u0000",
            ),
            ("gnp\u{202e}txt \u{ffff}", r"gnp\u202etxt \uffff"),
        ] {
            assert_eq!(harmless(text), shown);
        }
        let (large, small) = (
            format!("{} and {}", 1e308, -2.5e307),
            format!("[{}]", 1e-300),
        );
        assert!(large.len() > 600 && small.len() > 300);
        assert_eq!(harmless(&large), "1e308 and -2.5e307");
        assert_eq!(harmless(&small), "[1e-300]");
        assert_eq!(harmless(&format!("\u{1b}{}.", 1e100)), r"\u001b1e100");
    }
}
