//! The ring on a device: frames overlap, are reported once, and the trace shows it.

use super::*;
use crate::open_for_test;
use crate::timing::PassClock;

/// A pass that takes a while.
const WORK: &str = "
@group(0) @binding(0) var<storage, read_write> out: array<u32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    var x = id.x;
    for (var i = 0u; i < 20000u; i++) { x = x * 747796405u + 2891336453u; }
    out[id.x] = x;
}";

#[test]
fn frames_overlap_and_are_reported_once() {
    let name = "frames_overlap_and_are_reported_once";
    let Some(gpu) = open_for_test(name, &crate::GpuOptions::default()) else { return };
    let size = 64 * 64 * 4;
    let buffer =
        crate::scene::upload::empty_buffer(&gpu, "work", size, wgpu::BufferUsages::STORAGE).expect("memory");
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: false },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    });
    let pipeline = gpu.compute_pipeline("work", WORK, &[&layout]).expect("valid");
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
    });
    let mut frames = Frames::new(&gpu, 1).expect("memory");
    let mut reports = Vec::new();
    for (turn, depth) in [1, 3, 5, 2].into_iter().enumerate() {
        frames.set_depth(depth);
        for i in 0..8 {
            let slot = frames.begin(&gpu).expect("a slot");
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let times = frames.clock(slot).slot("work");
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: None,
                timestamp_writes: times.map(|s| s.compute()),
            });
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(64, 1, 1);
            drop(pass);
            let frame = frames.submit(&gpu, slot, encoder).expect("submitted");
            assert_eq!(frame, 8 * turn as u64 + i);
            assert!(frames.ring.in_flight() <= depth);
        }
        // The ring was filled, not emptied: who waits for one frame leaves the others in flight.
        assert_eq!(frames.ring.in_flight(), depth);
        reports.extend(frames.take_reports());
    }
    frames.finish(&gpu).expect("done");
    reports.extend(frames.take_reports());
    assert_eq!(reports.iter().map(|r| r.frame).collect::<Vec<_>>(), (0..32).collect::<Vec<_>>());
    let spans = frames.take_spans();
    let host = spans.iter().filter(|s| s.track == Track::Host && s.name == "prepare").count();
    assert_eq!(host, 32);
    if gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY) {
        assert!(reports.iter().all(|r| r.passes.len() == 1 && r.device() > Duration::ZERO));
        assert!(reports.iter().all(|r| r.latency.is_some()));
        assert_eq!(spans.iter().filter(|s| s.track == Track::Device).count(), 32);
        // With one frame at a time the host waits for each; what it waited for had ended.
        let device =
            |frame| spans.iter().find(|s| s.track == Track::Device && s.frame == frame).expect("a span");
        let prepares =
            |frame| spans.iter().find(|s| s.name == "prepare" && s.frame == frame).expect("a span");
        assert!((1..8).all(|f| prepares(f).start >= device(f - 1).end), "prepared before the slot was free");
        // The clocks agree: the device does not begin with what it has not been given. The host may hear late of every frame when it
        // is busy, and of how late the trace knows only the least.
        assert!((1..8).all(|f| device(f).end >= prepares(f).start), "done before it was prepared");
    }
}
