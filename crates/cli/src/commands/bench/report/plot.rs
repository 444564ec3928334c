//! Plots of curves, as SVG.

use super::html::escape;
use std::fmt::Write;

/// How numbers are laid along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps for equal differences.
    Linear,
    /// Equal steps for equal ratios; what is not above zero is left out.
    Log,
}

/// A curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its points.
    pub points: Vec<(f64, f64)>,
}

/// Curves over one axis.
#[derive(Clone, Debug)]
pub struct Plot {
    title: String,
    x: (String, Scale),
    y: (String, Scale),
    series: Vec<Series>,
}

/// Okabe and Ito's colours, which colour-blind readers can tell apart.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// Without the legend, which is right of it.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 380.0;
const LEFT: f64 = 78.0;
const TOP: f64 = 34.0;
const RIGHT: f64 = 20.0;
const BOTTOM: f64 = 52.0;
/// From one line of the legend to the next.
const LEGEND_LINE: f64 = 17.0;
/// Of a letter: fonts without serifs are narrower on average.
const LETTER_WIDTH: f64 = 7.0;

impl Plot {
    /// A plot without curves; the axes have a name (with its unit) and a scale.
    pub fn new(title: &str, x: (&str, Scale), y: (&str, Scale)) -> Self {
        let axis = |(name, scale): (&str, Scale)| (name.to_owned(), scale);
        Self { title: title.to_owned(), x: axis(x), y: axis(y), series: Vec::new() }
    }

    /// The plot with one curve more.
    #[must_use]
    pub fn with(mut self, name: &str, points: Vec<(f64, f64)>) -> Self {
        self.series.push(Series { name: name.to_owned(), points });
        self
    }

    /// The plot as an SVG element.
    pub fn svg(&self) -> String {
        let all = || self.series.iter().flat_map(|s| &s.points);
        let x = Axis::new(self.x.1, all().map(|p| p.0));
        let y = Axis::new(self.y.1, all().map(|p| p.1));
        let at_x = |v: f64| LEFT + (WIDTH - LEFT - RIGHT) * x.place(v);
        let at_y = |v: f64| HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * y.place(v);
        let names = self.series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        let width = WIDTH + 24.0 + LETTER_WIDTH * names as f64;
        let height = HEIGHT.max(TOP + LEGEND_LINE * (self.series.len() + 1) as f64);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
             <text x=\"{LEFT}\" y=\"20\" font-size=\"14\">{}</text>\n",
            escape(&self.title)
        );
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        // Writing to a string cannot fail, here and below.
        for tick in x.ticks() {
            let _ = writeln!(
                svg,
                "<path d=\"M{0:.1} {TOP}V{bottom}\" stroke=\"#e4e4e4\"/>\
                 <text x=\"{0:.1}\" y=\"{1}\" text-anchor=\"middle\">{2}</text>",
                at_x(tick),
                bottom + 18.0,
                label(tick)
            );
        }
        for tick in y.ticks() {
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {0:.1}H{right}\" stroke=\"#e4e4e4\"/>\
                 <text x=\"{1}\" y=\"{2:.1}\" text-anchor=\"end\">{3}</text>",
                at_y(tick),
                LEFT - 6.0,
                at_y(tick) + 4.0,
                label(tick)
            );
        }
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(16 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            (LEFT + right) / 2.0,
            HEIGHT - 12.0,
            escape(&self.x.0),
            (TOP + bottom) / 2.0,
            escape(&self.y.0)
        );
        for (i, series) in self.series.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let shown = series.points.iter().filter(|p| x.shows(p.0) && y.shows(p.1));
            let points: Vec<String> = shown.map(|p| format!("{:.1},{:.1}", at_x(p.0), at_y(p.1))).collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
                points.join(" ")
            );
            for point in &points {
                let (px, py) = point.split_once(',').unwrap_or_default();
                let _ = write!(svg, "<circle cx=\"{px}\" cy=\"{py}\" r=\"3\" fill=\"{colour}\"/>");
            }
            let legend = TOP + 14.0 + LEGEND_LINE * i as f64;
            let _ = writeln!(
                svg,
                "\n<rect x=\"{WIDTH}\" y=\"{:.1}\" width=\"14\" height=\"4\" fill=\"{colour}\"/>\
                 <text x=\"{}\" y=\"{legend:.1}\">{}</text>",
                legend - 6.0,
                WIDTH + 20.0,
                escape(&series.name)
            );
        }
        svg + "</svg>"
    }
}

/// A range of numbers along an axis.
struct Axis {
    scale: Scale,
    low: f64,
    high: f64,
}

impl Axis {
    /// Wide enough for all values that it can show.
    fn new(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let mut axis = Self { scale, low: 0.0, high: 1.0 };
        let mapped = values.filter(|v| axis.shows(*v)).map(|v| axis.map(v));
        let (low, high) = mapped.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low <= high {
            let low = if scale == Scale::Linear { low.min(0.0) } else { low };
            let margin = (0.04 * (high - low)).max(1e-9 + 0.02 * high.abs());
            (axis.low, axis.high) = (if low == 0.0 { 0.0 } else { low - margin }, high + margin);
        }
        axis
    }

    fn shows(&self, value: f64) -> bool {
        value.is_finite() && (self.scale == Scale::Linear || value > 0.0)
    }

    fn map(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.log10(),
        }
    }

    /// From 0 at the low end to 1 at the high one.
    fn place(&self, value: f64) -> f64 {
        (self.map(value) - self.low) / (self.high - self.low)
    }

    /// Round numbers in the range: some four to ten.
    fn ticks(&self) -> Vec<f64> {
        let span = self.high - self.low;
        if self.scale == Scale::Log {
            let (first, last) = (self.low.floor() as i32, self.high.ceil() as i32);
            let fine: &[f64] = if span < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let every = (span / 8.0).ceil().max(1.0) as usize;
            let decades = (first..=last).step_by(every);
            let all = decades.flat_map(|e| fine.iter().map(move |f| f * 10f64.powi(e)));
            return all.filter(|v| (0.0..=1.0).contains(&self.place(*v))).collect();
        }
        let rough = 10f64.powf((span / 5.0).log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * rough).find(|s| span / s <= 7.0);
        let step = step.unwrap_or(span);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

/// A number at a tick.
fn label(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        v if (1e-3..1e4).contains(&v) => {
            let text = format!("{value:.4}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let log = Axis::new(Scale::Log, [1e3, 1e6, -1.0, f64::NAN].into_iter());
        assert_eq!(log.ticks(), [1e3, 1e4, 1e5, 1e6]);
        let linear = Axis::new(Scale::Linear, [1.0, 9.0].into_iter());
        assert_eq!(linear.ticks(), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(label(0.25), "0.25");
        assert_eq!(label(1e6), "1e6");
    }

    /// The legend's lines are right of all curves and inside of the picture, however many there are.
    #[test]
    fn legends_hide_no_curve() {
        let points = vec![(0.0, 1.0), (1.0, 100.0)];
        let plot = Plot::new("t", ("x", Scale::Linear), ("y", Scale::Linear));
        let plot = (0..40).fold(plot, |p, i| p.with(&format!("curve number {i}"), points.clone()));
        let svg = plot.svg();
        let number = |text: &str, name: &str| -> f64 {
            let rest = text.split_once(&format!(" {name}=\"")).expect("has it").1;
            rest.split('"').next().unwrap().parse().unwrap()
        };
        let size = svg.split_once("viewBox=\"0 0 ").unwrap().1.split('"').next().unwrap();
        let (width, height) = size.split_once(' ').unwrap();
        let [width, height]: [f64; 2] = [width, height].map(|n| n.parse().unwrap());
        let curves = svg.split("<circle").skip(1).map(|c| number(c, "cx"));
        let right = curves.fold(0.0, f64::max);
        let lines: Vec<_> = svg.lines().filter(|l| l.contains("curve number")).collect();
        assert_eq!(lines.len(), 40);
        for line in lines {
            assert!(number(line, "x") > right, "{line}");
            let text = line.split_once("<text").unwrap().1;
            assert!(number(text, "x") + 15.0 * 6.0 < width && number(text, "y") < height, "{line}");
        }
    }

    #[test]
    fn higher_is_higher_up() {
        let plot = Plot::new("t", ("x", Scale::Linear), ("y", Scale::Log));
        let svg = plot.with("a", vec![(0.0, 1.0), (1.0, 100.0), (2.0, 0.0)]).svg();
        let line = svg.lines().find(|l| l.contains("<polyline")).unwrap();
        let points = line.split('"').nth(1).unwrap();
        let ys: Vec<f64> = points.split(' ').map(|p| p.split_once(',').unwrap().1.parse().unwrap()).collect();
        assert_eq!(ys.len(), 2, "a logarithm of zero is left out");
        assert!(ys[1] < ys[0], "{svg}");
    }
}
