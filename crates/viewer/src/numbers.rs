//! How numbers are written.

use egui::style::NumberFormatter;

/// A number with as few of the allowed decimals as tell it, and no sign where they are all zeros.
pub fn text(value: f64, decimals: std::ops::RangeInclusive<usize>) -> String {
    unsigned_zero(egui::emath::format_with_decimals_in_range(value, decimals))
}

/// A number with so many decimals, and no sign where they are all zeros.
pub fn fixed(value: f32, decimals: usize) -> String {
    unsigned_zero(format!("{value:.decimals$}"))
}

fn unsigned_zero(text: String) -> String {
    let is_zero = text.chars().all(|c| !c.is_ascii_digit() || c == '0');
    if is_zero { text.trim_start_matches(['-', '−', '+']).to_owned() } else { text }
}

/// Has all numbers of a window written so.
pub fn write_in(ui: &mut egui::Ui) {
    ui.style_mut().number_formatter = NumberFormatter::new(text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_have_no_sign() {
        assert_eq!(text(-0.0, 1..=4), "0.0");
        assert_eq!(text(-0.00001, 1..=1), "0.0");
        assert_eq!(text(0.25, 1..=4), "0.25");
        assert_eq!(text(-0.25, 1..=4).chars().count(), 5);
        assert_eq!(fixed(-0.00001, 4), "0.0000");
        assert_eq!(fixed(-0.5, 2), "-0.50");
    }
}
