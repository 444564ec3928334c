//! A number that is typed while a handle is dragged.

use egui::{Event, Key};

/// What was typed so far.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Typed(String);

impl Typed {
    /// The text, as it stands.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// The number; `None` while there is none.
    pub fn number(&self) -> Option<f32> {
        self.0.parse().ok().filter(|v: &f32| v.is_finite())
    }

    /// Takes what was typed in a frame. Minus changes the sign, wherever it is typed.
    pub fn take(&mut self, events: &[Event]) {
        for event in events {
            match event {
                Event::Text(text) => text.chars().for_each(|c| self.push(c)),
                Event::Key { key: Key::Backspace, pressed: true, .. } => drop(self.0.pop()),
                _ => {}
            }
        }
    }

    fn push(&mut self, c: char) {
        let has_point = self.0.contains('.');
        match c {
            '0'..='9' if self.0.len() < 12 => self.0.push(c),
            '.' | ',' if !has_point => self.0.push('.'),
            '-' => match self.0.strip_prefix('-') {
                Some(rest) => self.0 = rest.to_owned(),
                None => self.0.insert(0, '-'),
            },
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_typed_with_sign_and_point() {
        let mut typed = Typed::default();
        assert_eq!(typed.number(), None);
        typed.take(&[Event::Text("1,5x".into()), Event::Text(".-2".into())]);
        assert_eq!((typed.text(), typed.number()), ("-1.52", Some(-1.52)));
        let back = Event::Key {
            key: Key::Backspace,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Default::default(),
        };
        typed.take(&[back, Event::Text("-".into())]);
        assert_eq!(typed.number(), Some(1.5));
    }
}
