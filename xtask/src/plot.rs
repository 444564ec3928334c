//! A plot of ratios with their spread, as SVG.

use std::fmt::Write;

/// A bar: its name, the median, and the smallest and largest value.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// What was measured.
    pub name: String,
    /// Smallest, median and largest ratio.
    pub ratio: [f64; 3],
}

/// Horizontal bars with whiskers and a line at 1.
pub fn bars(title: &str, bars: &[Bar]) -> String {
    let (left, width, row, top) = (110.0, 480.0, 34.0, 44.0);
    let largest = bars.iter().map(|b| b.ratio[2]).fold(1.0, f64::max) * 1.1;
    let x = |ratio: f64| left + width * ratio / largest;
    let height = top + row * bars.len() as f64 + 30.0;
    let total = left + width + 60.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {total} {height}\" width=\"{total}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text x=\"{left}\" y=\"22\" font-size=\"14\">{}</text>\n",
        escape(title)
    );
    for (i, bar) in bars.iter().enumerate() {
        let y = top + row * i as f64;
        let (middle, [low, median, high]) = (y + 11.0, bar.ratio.map(x));
        let fill = if bar.ratio[1] >= 1.0 { "#2a7f62" } else { "#b5473c" };
        let name = escape(&bar.name);
        // Writing to a string cannot fail.
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{name}</text>\
             <rect x=\"{left}\" y=\"{y}\" width=\"{:.1}\" height=\"22\" fill=\"{fill}\"/>\
             <path d=\"M{low:.1} {middle}H{high:.1}M{low:.1} {}v8M{high:.1} {}v8\" stroke=\"#000\" fill=\"none\"/>\
             <text x=\"{:.1}\" y=\"{}\">{:.2}×</text>",
            left - 8.0,
            middle + 5.0,
            median - left,
            middle - 4.0,
            middle - 4.0,
            high + 6.0,
            middle + 5.0,
            bar.ratio[1]
        );
    }
    let (one, bottom) = (x(1.0), height - 26.0);
    let _ = writeln!(
        svg,
        "<path d=\"M{one:.1} {}V{bottom}\" stroke=\"#555\" stroke-dasharray=\"4 3\"/>\
         <text x=\"{one:.1}\" y=\"{}\" text-anchor=\"middle\" fill=\"#555\">1×</text>\n</svg>",
        top - 8.0,
        bottom + 16.0
    );
    svg
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_their_median() {
        let svg = bars("a & b", &[Bar { name: "one".into(), ratio: [0.9, 1.0, 1.1] }]);
        assert!(svg.contains("a &amp; b") && svg.contains("1.00×"), "{svg}");
        // 480 units are 1.1 × the largest ratio, 1.1.
        assert!(svg.contains(&format!("width=\"{:.1}\"", 480.0 / 1.21)), "{svg}");
    }
}
