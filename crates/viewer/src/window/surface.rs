//! The window's surface: what egui has drawn goes to the screen, or to a picture.

use egui::{ClippedPrimitive, TexturesDelta};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use std::sync::Arc;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// Why there is no surface to draw on.
#[derive(Debug, thiserror::Error)]
pub enum SurfaceError {
    /// The system made none for the window.
    #[error("cannot draw on the window")]
    Create(#[from] wgpu::CreateSurfaceError),
    /// No driver can draw on it.
    #[error("no graphics driver can draw on the window")]
    Adapter(#[from] wgpu::RequestAdapterError),
    /// The driver gives no device.
    #[error("the graphics driver provides no device")]
    Device(#[from] wgpu::RequestDeviceError),
    /// The driver offers no format.
    #[error("the graphics driver has no format for the window")]
    Format,
}

/// A device that draws on the window.
pub struct Surface {
    surface: wgpu::Surface<'static>,
    device: wgpu::Device,
    queue: wgpu::Queue,
    config: wgpu::SurfaceConfiguration,
    renderer: Renderer,
}

/// What egui wants drawn in a frame.
pub struct Drawing {
    /// Triangles.
    pub primitives: Vec<ClippedPrimitive>,
    /// New and changed textures, and those to free.
    pub textures: TexturesDelta,
    /// Physical pixels per point.
    pub pixels_per_point: f32,
}

impl Surface {
    /// Opens a device for the window.
    pub fn new(event_loop: &ActiveEventLoop, window: Arc<Window>) -> Result<Self, SurfaceError> {
        let display = Box::new(event_loop.owned_display_handle());
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::PRIMARY.with_env(),
            // The validation layer of many systems is older than the shaders that wgpu writes.
            flags: wgpu::InstanceFlags::empty().with_env(),
            ..wgpu::InstanceDescriptor::new_with_display_handle(display)
        });
        let size = window.inner_size();
        let surface = instance.create_surface(window)?;
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            // Drawing panels is no work: leave the fast chip to the renderer.
            power_preference: wgpu::PowerPreference::LowPower,
            compatible_surface: Some(&surface),
            ..Default::default()
        }))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("window"),
            required_limits: wgpu::Limits {
                max_texture_dimension_2d: adapter.limits().max_texture_dimension_2d.min(16_384),
                ..wgpu::Limits::downlevel_defaults()
            },
            ..Default::default()
        }))?;
        let formats = surface.get_capabilities(&adapter).formats;
        // egui blends encoded values: a format that encodes would do it twice.
        let format = formats.iter().find(|f| !f.is_srgb()).or(formats.first()).ok_or(SurfaceError::Format)?;
        let mut config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or(SurfaceError::Format)?;
        config.format = *format;
        config.present_mode = wgpu::PresentMode::AutoVsync;
        config.desired_maximum_frame_latency = 1;
        surface.configure(&device, &config);
        // Pixels have the picture's values, without noise that hides steps of colour; software drivers are quicker so.
        let options = RendererOptions { dithering: false, ..RendererOptions::default() };
        let renderer = Renderer::new(&device, config.format, options);
        Ok(Self { surface, device, queue, config, renderer })
    }

    /// The longest side that textures may have.
    pub fn max_texture_side(&self) -> usize {
        self.device.limits().max_texture_dimension_2d as usize
    }

    /// Follows the window's size, in physical pixels.
    pub fn resize(&mut self, width: u32, height: u32) {
        let size = (width.max(1), height.max(1));
        if (self.config.width, self.config.height) != size {
            (self.config.width, self.config.height) = size;
            self.surface.configure(&self.device, &self.config);
        }
    }

    /// Draws a frame on the window. With `capture`, returns it as a picture, too: `width × height` RGBA, row 0 at the top.
    pub fn draw(&mut self, mut drawing: Drawing, capture: bool) -> Option<Capture> {
        for (id, deltas) in drawing.textures.set.drain() {
            for delta in &deltas {
                self.renderer.update_texture(&self.device, &self.queue, id, delta);
            }
        }
        let screen = ScreenDescriptor {
            size_in_pixels: [self.config.width, self.config.height],
            pixels_per_point: drawing.pixels_per_point,
        };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut commands = self.renderer.update_buffers(
            &self.device,
            &self.queue,
            &mut encoder,
            &drawing.primitives,
            &screen,
        );
        let frame = self.acquire();
        if let Some(frame) = &frame {
            let view = frame.texture.create_view(&Default::default());
            self.paint(&mut encoder, &view, &drawing.primitives, &screen);
        }
        let buffer = capture.then(|| self.paint_for_capture(&mut encoder, &drawing.primitives, &screen));
        commands.push(encoder.finish());
        self.queue.submit(commands);
        if let Some(frame) = frame {
            self.queue.present(frame);
        }
        drawing.textures.free.drain().for_each(|id| self.renderer.free_texture(&id));
        buffer.and_then(|buffer| self.read(&buffer))
    }

    /// The texture that is shown next; `None` while the window cannot be drawn on.
    fn acquire(&mut self) -> Option<wgpu::SurfaceTexture> {
        use wgpu::CurrentSurfaceTexture::{
            Lost, Occluded, Outdated, Suboptimal, Success, Timeout, Validation,
        };
        match self.surface.get_current_texture() {
            Success(frame) | Suboptimal(frame) => Some(frame),
            Outdated | Lost => {
                self.surface.configure(&self.device, &self.config);
                match self.surface.get_current_texture() {
                    Success(frame) | Suboptimal(frame) => Some(frame),
                    Outdated | Lost | Timeout | Occluded | Validation => None,
                }
            }
            Timeout | Occluded | Validation => None,
        }
    }

    fn paint(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        primitives: &[ClippedPrimitive],
        screen: &ScreenDescriptor,
    ) {
        let attachment = wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        };
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        self.renderer.render(&mut pass.forget_lifetime(), primitives, screen);
    }

    /// Bytes from one row of a captured picture to the next: WebGPU wants multiples of 256.
    fn row_bytes(&self) -> u32 {
        (self.config.width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
    }

    fn paint_for_capture(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        primitives: &[ClippedPrimitive],
        screen: &ScreenDescriptor,
    ) -> wgpu::Buffer {
        let size =
            wgpu::Extent3d { width: self.config.width, height: self.config.height, depth_or_array_layers: 1 };
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("capture"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.config.format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        self.paint(encoder, &texture.create_view(&Default::default()), primitives, screen);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("capture"),
            size: u64::from(self.row_bytes()) * u64::from(size.height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.row_bytes()),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            size,
        );
        buffer
    }

    fn read(&self, buffer: &wgpu::Buffer) -> Option<Capture> {
        let slice = buffer.slice(..);
        slice.map_async(wgpu::MapMode::Read, |_| {});
        self.device.poll(wgpu::PollType::wait_indefinitely()).ok()?;
        let bytes = slice.get_mapped_range().ok()?;
        let blue_first = matches!(
            self.config.format,
            wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb
        );
        let rows =
            bytes.chunks(self.row_bytes() as usize).flat_map(|row| &row[..self.config.width as usize * 4]);
        let mut rgba: Vec<u8> = rows.copied().collect();
        if blue_first {
            rgba.chunks_exact_mut(4).for_each(|p| p.swap(0, 2));
        }
        Some(Capture { width: self.config.width, height: self.config.height, rgba })
    }
}

/// What the window shows.
pub struct Capture {
    /// Physical pixels.
    pub width: u32,
    /// Physical pixels.
    pub height: u32,
    /// Row 0 at the top.
    pub rgba: Vec<u8>,
}

impl Capture {
    /// Writes it as PNG.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &std::path::Path) -> Result<(), alhazen::ImageError> {
        let image = alhazen::Image::from_fn(self.width, self.height, |x, y| {
            let i = (y as usize * self.width as usize + x as usize) * 4;
            [0, 1, 2].map(|c| f32::from(self.rgba[i + c]) / 255.0)
        });
        image.write_png_encoded(path)
    }
}
