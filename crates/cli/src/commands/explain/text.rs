//! Paths for people.

use super::Explained;
use alhazen::{
    FoundLight, LightSampleRecord, LightVisibility, PathRecord, SampleRecord, ScatteringRecord, VertexPlace,
    VertexRecord,
};
use std::fmt::Write;

/// All samples; writing to a string cannot fail.
pub fn of(explained: &Explained) -> String {
    let mut text = String::new();
    for sample in &explained.samples {
        write_sample(&mut text, explained, sample);
    }
    if explained.samples.len() > 1 {
        let _ = writeln!(text, "mean of {} samples: {}", explained.samples.len(), rgb(explained.mean()));
    }
    text
}

fn write_sample(text: &mut String, explained: &Explained, sample: &SampleRecord) {
    let [x, y] = sample.pixel;
    let radiance = rgb(sample.radiance);
    let _ =
        writeln!(text, "pixel {x},{y}, sample {}: radiance {radiance}, {} rays", sample.sample, sample.rays);
    for (number, path) in sample.paths.iter().enumerate() {
        if sample.paths.len() > 1 {
            let _ = writeln!(text, "path {} of {}: {}", number + 1, sample.paths.len(), rgb(path.radiance));
        }
        write_path(text, explained, path);
    }
    text.push('\n');
}

fn write_path(text: &mut String, explained: &Explained, path: &PathRecord) {
    let _ = writeln!(text, "  0  camera at {}", xyz(path.origin));
    for vertex in &path.vertices {
        write_vertex(text, explained, vertex);
    }
    let _ = writeln!(text, "  end: {}", path.end.description());
}

fn write_vertex(text: &mut String, explained: &Explained, vertex: &VertexRecord) {
    let _ = match &vertex.place {
        VertexPlace::Distant => {
            writeln!(text, "  {}  out of the scene along {}", vertex.depth, xyz(vertex.direction))
        }
        VertexPlace::Surface(surface) => {
            let side = if surface.front { "front" } else { "back" };
            let (instance, material) = (surface.instance, surface.material);
            writeln!(
                text,
                "  {}  {:?} (instance {instance}, primitive {}), material {material} {:?}, {side}, after {} m\n     \
                 at {}, normal {}",
                vertex.depth,
                explained.instance(instance),
                surface.primitive,
                explained.material(material),
                number(vertex.distance),
                xyz(surface.position),
                xyz(surface.shading_normal),
            )
        }
    };
    let _ = writeln!(text, "     throughput  {}", rgb(vertex.throughput));
    vertex.found.iter().for_each(|found| write_found(text, found));
    vertex.light_sample.iter().for_each(|sample| write_light_sample(text, sample));
    vertex.scattering.iter().for_each(|scattering| write_scattering(text, scattering));
}

fn write_found(text: &mut String, found: &FoundLight) {
    let how = match found.scattering_pdf {
        Some(pdf) => format!(
            "weight {} (pdf {}, of light samples {})",
            number(found.weight),
            number(pdf),
            number(found.light_pdf)
        ),
        None => "in full: no other technique finds it".into(),
    };
    let (radiance, contribution) = (rgb(found.radiance), rgb(found.contribution));
    let _ = writeln!(text, "     found       radiance {radiance}, {how}: adds {contribution}");
}

fn write_light_sample(text: &mut String, sample: &LightSampleRecord) {
    let (kind, light, place) = (sample.kind, sample.light, number(sample.distance));
    let visibility = sample.visibility.name();
    let _ = write!(text, "     light       {kind} {light}, {place} m away, {visibility}");
    if sample.visibility == LightVisibility::Behind {
        text.push('\n');
        return;
    }
    let weight = if sample.delta { "in full".into() } else { format!("weight {}", number(sample.weight)) };
    let (radiance, scattering) = (rgb(sample.radiance), rgb(sample.scattering));
    let densities = format!("pdf {}, of scattering {}", number(sample.pdf), number(sample.scattering_pdf));
    let _ = writeln!(
        text,
        ": radiance {radiance} × BSDF·cos {scattering}, {weight} ({densities}): adds {}",
        rgb(sample.contribution)
    );
}

fn write_scattering(text: &mut String, scattering: &ScatteringRecord) {
    let mut how = scattering.model.to_owned();
    if scattering.transmitted {
        how += ", through";
    }
    let density = if scattering.delta { "delta".into() } else { format!("pdf {}", number(scattering.pdf)) };
    let _ = write!(
        text,
        "     scattering  {how}, along {}, {density}, weight {}",
        xyz(scattering.direction),
        rgb(scattering.weight)
    );
    if scattering.survival < 1.0 {
        let fate = if scattering.alive { "survives" } else { "ends" };
        let _ = write!(text, ", roulette with {}: {fate}", number(scattering.survival));
    }
    text.push('\n');
}

/// Four digits that count.
fn number(value: f32) -> String {
    let scientific = format!("{value:.3e}");
    let size = scientific.split_once('e').and_then(|(_, exponent)| exponent.parse::<i32>().ok());
    match size {
        _ if value == 0.0 => "0".into(),
        Some(size @ -4..6) => format!("{value:.*}", (3 - size).max(0) as usize),
        Some(_) => scientific,
        // Not finite.
        None => value.to_string(),
    }
}

fn rgb(c: [f32; 3]) -> String {
    if c[0] == c[1] && c[1] == c[2] {
        return number(c[0]);
    }
    format!("({})", c.map(number).join(", "))
}

fn xyz(v: [f32; 3]) -> String {
    format!("({})", v.map(number).join(", "))
}

#[cfg(test)]
mod tests {
    use super::{number, rgb};

    #[test]
    fn numbers_have_four_digits() {
        let expected = ["0", "inf", "12.50", "0.001234", "1.236e-5", "123457", "-0.5000"];
        let values = [0.0, f32::INFINITY, 12.5, 0.001_234, 0.000_012_36, 123_456.7, -0.5];
        assert_eq!(values.map(number), expected);
        assert_eq!((rgb([0.5; 3]), rgb([1.0, 0.0, 0.5])), ("0.5000".into(), "(1.000, 0, 0.5000)".into()));
    }
}
