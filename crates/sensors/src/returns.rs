//! From the rays that sample a beam to what the receiver tells of it.

use alhazen::BeamEcho;

/// Which return of a beam counts where it meets several surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReturnMode {
    /// The nearest.
    First,
    /// The one with the highest intensity.
    #[default]
    Strongest,
    /// The farthest.
    Last,
    /// Every one, nearest first.
    All,
}

/// What a receiver tells of a pulse of light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Echo {
    /// Distance, metres.
    pub range: f32,
    /// Share of the light that comes back, 1 for a white diffuse surface that faces the sensor.
    pub intensity: f32,
    /// Index of the instance.
    pub instance: u32,
}

impl From<&BeamEcho> for Echo {
    /// Lasers of scanners are near infrared: red is the closest that scenes know.
    fn from(echo: &BeamEcho) -> Self {
        Self { range: echo.range, intensity: echo.intensity[0], instance: echo.instance }
    }
}

/// The returns of a beam from the echoes of its `rays` rays; none without any.
///
/// Echoes that follow each other closer than `resolution` metres melt into one pulse. Its range is the mean of theirs, by
/// intensity; its intensity is their sum over the number of rays, so that light which misses is missing.
pub(crate) fn beam_returns(echoes: &mut [Echo], rays: u32, resolution: f32, mode: ReturnMode) -> Vec<Echo> {
    echoes.sort_unstable_by(|a, b| a.range.total_cmp(&b.range));
    let mut pulses = echoes.chunk_by(|a, b| b.range - a.range <= resolution).map(|p| pulse(p, rays));
    let one = match mode {
        ReturnMode::First => pulses.next(),
        ReturnMode::Last => pulses.next_back(),
        ReturnMode::Strongest => pulses.reduce(|a, b| if b.intensity > a.intensity { b } else { a }),
        ReturnMode::All => return pulses.collect(),
    };
    one.into_iter().collect()
}

fn pulse(echoes: &[Echo], rays: u32) -> Echo {
    let total: f64 = echoes.iter().map(|e| f64::from(e.intensity)).sum();
    // Where nothing comes back all echoes count alike: the receiver's threshold decides elsewhere.
    let weight =
        |e: &Echo| if total > 0.0 { f64::from(e.intensity) / total } else { 1.0 / echoes.len() as f64 };
    let range: f64 = echoes.iter().map(|e| f64::from(e.range) * weight(e)).sum();
    let brightest = echoes.iter().max_by(|a, b| a.intensity.total_cmp(&b.intensity));
    Echo {
        range: range as f32,
        intensity: (total / f64::from(rays)) as f32,
        instance: brightest.map_or(u32::MAX, |e| e.instance),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn echo(range: f32, intensity: f32, instance: u32) -> Echo {
        Echo { range, intensity, instance }
    }

    #[test]
    fn echoes_melt_into_pulses() {
        let all = [echo(10.0, 0.2, 2), echo(5.2, 0.5, 1), echo(5.0, 0.5, 0), echo(10.1, 0.6, 3)];
        let returns = |mode| beam_returns(&mut all.clone(), 8, 0.3, mode);
        let of = |mode| returns(mode)[0];
        let (first, last) = (of(ReturnMode::First), of(ReturnMode::Last));
        assert_eq!(returns(ReturnMode::All), [first, last]);
        assert!((first.range - 5.1).abs() < 1e-6 && (first.intensity - 1.0 / 8.0).abs() < 1e-6);
        assert!(
            (last.range - 10.075).abs() < 1e-6 && (last.intensity - 0.1).abs() < 1e-6 && last.instance == 3
        );
        assert_eq!(of(ReturnMode::Strongest), first);
        assert_eq!(beam_returns(&mut [], 8, 0.3, ReturnMode::First), []);
    }

    #[test]
    fn black_surfaces_have_a_range_and_no_intensity() {
        let black = beam_returns(&mut [echo(2.0, 0.0, 4), echo(2.1, 0.0, 4)], 2, 0.3, ReturnMode::Strongest);
        let black = black[0];
        assert!((black.range - 2.05).abs() < 1e-6 && black.intensity == 0.0 && black.instance == 4);
    }
}
