//! What a film looks like on a texture, against the optics on the CPU.

use super::*;
use crate::film::FilmPixel;
use crate::layout::{assert_layout, layout_of};
use crate::open_for_test;
use crate::readback::read_mapped;
use crate::shader::check;
use crate::timing::TimerSlot;
use backend::{Integrator, PathSettings, SamplerKind, View};
use film::{PixelStats, Rect};
use optics::camera::{CAMERA_PERSPECTIVE, CameraFrame};
use optics::tonemap::tonemap;
use optics::{vec2f, vec3f};
use wgpu::TextureFormat;

#[test]
fn layouts_match_the_shader() {
    let module = check::module("screen");
    assert_layout!(module, Shown { film_size, screen_size, mapper, padding0, padding1, padding2 });
    assert_eq!(layout_of(&module, "FilmPixel"), layout_of(&check::module("film"), "FilmPixel"));
}

/// Nobody reads the times.
struct NoClock;

impl PassClock for NoClock {
    fn slot(&mut self, _: &'static str) -> Option<TimerSlot<'_>> {
        None
    }
}

/// A view of 3 × 2 pixels.
fn view() -> View {
    let camera = CameraFrame {
        kind: CAMERA_PERSPECTIVE,
        origin: vec3f(0.0, 0.0, 0.0),
        right: vec3f(1.0, 0.0, 0.0),
        up: vec3f(0.0, 1.0, 0.0),
        forward: vec3f(0.0, 0.0, -1.0),
        half_size: vec2f(0.5, 0.5),
        lens_radius: 0.0,
        focus_distance: 1.0,
        distortion: optics::distortion::no_distortion(),
    };
    View {
        camera,
        width: 3,
        height: 2,
        window: Rect { x: 0, y: 0, width: 3, height: 2 },
        first_sample: 0,
        sampler: SamplerKind::Sobol,
        seed: 0,
        single_scatter: false,
        integrator: Integrator::Path(PathSettings::default()),
        aovs: Vec::new(),
        shutter: None,
    }
}

/// Radiance of a pixel of the film; the last one has no samples.
fn radiance(x: u32, y: u32) -> [f32; 3] {
    match (x, y) {
        (2, 1) => [0.0; 3],
        _ => [0.1 + 0.2 * x as f32, 0.02 + 0.3 * y as f32, 2.0 * x as f32],
    }
}

/// Draws the film on a texture of some size and format, and reads it: RGBA or BGRA bytes of its pixels, row by row.
fn drawn(gpu: &Gpu, format: TextureFormat, [width, height]: [u32; 2]) -> Vec<[u8; 4]> {
    let film = FilmBuffers::new(gpu, &view(), false).expect("small");
    let pixels = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)].map(|(x, y)| {
        let mut stats = PixelStats::default();
        // A mean of two.
        if (x, y) != (2, 1) {
            let c = radiance(x, y);
            assert!(stats.add(c.map(|c| 1.5 * c)) && stats.add(c.map(|c| 0.5 * c)));
        }
        FilmPixel::of(&stats)
    });
    write_buffer(gpu, "the film", &film.pixels, bytemuck::cast_slice(&pixels)).expect("room");
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let row = 256;
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let readable = empty_buffer(gpu, "read", u64::from(row * height), usage).expect("memory");
    let mut pass = ScreenPass::new(gpu, format).expect("compiles");
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    pass.record(gpu, &mut encoder, &mut NoClock, &film, &texture).expect("recorded");
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &readable, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, size);
    gpu.queue.submit([encoder.finish()]);
    let bytes = readable.size();
    let rows = read_mapped(gpu, &readable, bytes, "reading", |b| b.to_vec()).expect("read");
    let pixels = rows.chunks(row as usize).flat_map(|r| r[..4 * width as usize].chunks(4));
    pixels.map(|p| [p[0], p[1], p[2], p[3]]).collect()
}

/// The byte of a display value in `[0, 1]`.
fn byte(v: f32) -> u8 {
    (255.0 * v).round() as u8
}

#[test]
fn films_are_shown_as_files_are_written() {
    let name = "films_are_shown_as_files_are_written";
    let Some(gpu) = open_for_test(name, &crate::GpuOptions::default()) else { return };
    // Twice as wide: each pixel of the film is shown twice.
    for (format, size, blue_first) in [
        (TextureFormat::Rgba8Unorm, [3, 2], false),
        (TextureFormat::Bgra8Unorm, [6, 2], true),
        (TextureFormat::Rgba8UnormSrgb, [3, 2], false),
    ] {
        let bytes = drawn(&gpu, format, size);
        for (i, &[a, g, b, alpha]) in bytes.iter().enumerate() {
            let (x, y) = (i as u32 % size[0] * 3 / size[0], i as u32 / size[0]);
            let shown = if blue_first { [b, g, a] } else { [a, g, b] };
            let [r, g, b] = radiance(x, y);
            let expected = tonemap(TONEMAP_SRGB, vec3f(r, g, b), 1.0, 1.0).to_array().map(byte);
            // Devices may round a value between two bytes either way, and their encoding is within a byte.
            let close = shown.iter().zip(expected).all(|(s, e)| s.abs_diff(e) <= 1);
            assert!(close && alpha == 255, "{format:?} {x} {y}: {shown:?} instead of {expected:?}");
        }
        assert!(bytes.iter().any(|p| p[1] > 100), "{format:?}: everything is dark");
    }
}
