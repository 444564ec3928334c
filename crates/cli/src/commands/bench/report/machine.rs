//! What a report says about the machine and the program.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// Program, commit, command, date, system, processor and how busy it was.
pub fn about() -> Vec<(String, String)> {
    let pair = |key: &str, value: String| (key.to_owned(), value);
    vec![
        pair("version", env!("CARGO_PKG_VERSION").to_owned()),
        pair("build", if cfg!(debug_assertions) { "dev" } else { "release" }.to_owned()),
        pair("commit", commit()),
        pair("command", std::env::args().collect::<Vec<_>>().join(" ")),
        pair("date", date(SystemTime::now())),
        pair("system", format!("{} {}", std::env::consts::OS, std::env::consts::ARCH)),
        pair("processor", processor()),
        pair("load average", read("/proc/loadavg").unwrap_or_else(unknown)),
    ]
}

fn unknown() -> String {
    "unknown".to_owned()
}

/// What `ALHAZEN_COMMIT` says, or else git of the current folder.
fn commit() -> String {
    let named = std::env::var("ALHAZEN_COMMIT").ok();
    let asked = || {
        let output =
            Command::new("git").args(["describe", "--always", "--dirty", "--abbrev=12"]).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    named.or_else(asked).unwrap_or_else(unknown)
}

fn read(path: &str) -> Option<String> {
    std::fs::read_to_string(path).ok().map(|text| text.trim().to_owned())
}

fn processor() -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let name = alhazen::system::processor_name().unwrap_or_else(unknown);
    format!("{name}, {threads} threads")
}

/// Date and time in UTC, to the minute: `2001-02-03 04:05 UTC`.
///
/// Method: Hinnant, "chrono-Compatible Low-Level Date Algorithms", `civil_from_days`.
pub fn date(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (days, minutes) = (seconds / 86_400 + 719_468, seconds % 86_400 / 60);
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02} {:02}:{:02} UTC", minutes / 60, minutes % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn dates_are_right() {
        let at = |seconds| date(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01 00:00 UTC");
        assert_eq!(at(951_782_400), "2000-02-29 00:00 UTC");
        assert_eq!(at(951_868_799), "2000-02-29 23:59 UTC");
        assert_eq!(at(1_735_689_600), "2025-01-01 00:00 UTC");
    }
}
