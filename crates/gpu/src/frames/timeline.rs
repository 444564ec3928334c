//! What host and device did when, for chrome://tracing and Perfetto.

use std::fmt::Write;
use std::time::Duration;

/// Who did it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Track {
    /// The host.
    Host,
    /// The device, by its own clock, moved to the host's.
    Device,
}

/// Something that took time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Who.
    pub track: Track,
    /// What.
    pub name: &'static str,
    /// For which frame.
    pub frame: u64,
    /// When it began, since the ring was made.
    pub start: Duration,
    /// When it ended.
    pub end: Duration,
}

/// Writes spans as a trace in Chrome's JSON: an array of complete events, microseconds.
pub fn chrome_trace(spans: &[Span]) -> String {
    let mut text = String::from("[\n");
    for (number, track) in ["host", "device"].iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            r#"{{"name":"thread_name","ph":"M","pid":1,"tid":{number},"args":{{"name":"{track}"}}}},"#
        );
    }
    for (i, span) in spans.iter().enumerate() {
        let microseconds = |d: Duration| d.as_secs_f64() * 1e6;
        let thread = if span.track == Track::Host { 0 } else { 1 };
        let (start, length) = (microseconds(span.start), microseconds(span.end.saturating_sub(span.start)));
        let comma = if i + 1 < spans.len() { "," } else { "" };
        let _ = writeln!(
            text,
            r#"{{"name":"{}","ph":"X","pid":1,"tid":{thread},"ts":{start:.3},"dur":{length:.3},"args":{{"frame":{}}}}}{comma}"#,
            span.name, span.frame
        );
    }
    if spans.is_empty() {
        // No comma may stand before the end.
        let end = text.trim_end().trim_end_matches(',').len();
        text.truncate(end);
        text.push('\n');
    }
    text.push_str("]\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn traces_have_a_line_for_each_span() {
        let span = |track, start: u64| Span {
            track,
            name: "draw",
            frame: 7,
            start: Duration::from_micros(start),
            end: Duration::from_nanos(1000 * start + 2500),
        };
        let text = chrome_trace(&[span(Track::Host, 10), span(Track::Device, 20)]);
        assert!(text.contains(r#""tid":1,"ts":20.000,"dur":2.500,"args":{"frame":7}}"#), "{text}");
        assert!(text.contains(r#""tid":0,"ts":10.000,"dur":2.500,"args":{"frame":7}},"#), "{text}");
        for text in [text, chrome_trace(&[])] {
            assert_eq!(text.matches('{').count(), text.matches('}').count());
            assert!(!text.replace(char::is_whitespace, "").contains(",]"), "{text}");
        }
    }
}
