//! What a scan measured, and its files.

use crate::error::SensorError;
use crate::npz::Npz;
use alhazen::{ImageError, write_atomically};
use std::io::Write;
use std::path::Path;

/// Points of one sweep, an array for each property.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Positions in the sensor's frame (x forward, y left, z up), metres.
    pub positions: Vec<[f32; 3]>,
    /// Distance from the sensor, noise included, metres.
    pub ranges: Vec<f32>,
    /// Share of the light that comes back, as a calibrated sensor tells it: 1 is a white diffuse surface that faces the
    /// sensor, at any distance.
    pub intensities: Vec<f32>,
    /// Number of the laser.
    pub channels: Vec<u16>,
    /// Number of the firing in the sweep.
    pub firings: Vec<u32>,
    /// Index of the instance that was met.
    pub instances: Vec<u32>,
}

impl PointCloud {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.ranges.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    pub(crate) fn push(
        &mut self,
        position: [f32; 3],
        range: f32,
        intensity: f32,
        channel: u16,
        firing: u32,
        instance: u32,
    ) {
        self.positions.push(position);
        self.ranges.push(range);
        self.intensities.push(intensity);
        self.channels.push(channel);
        self.firings.push(firing);
        self.instances.push(instance);
    }

    /// Writes a binary .ply (x, y, z, range, intensity, channel, firing, instance) or an .npz with arrays of the names of this
    /// type's fields. Complete, or not at all.
    ///
    /// # Errors
    /// [`SensorError::UnknownFormat`] or [`SensorError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), SensorError> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let failed = |source| ImageError::Write { path: path.to_owned(), source };
        match ending.as_str() {
            "ply" => write_atomically(path, |writer| self.write_ply(writer).map_err(failed))?,
            "npz" => {
                let archive = self.npz().map_err(failed)?;
                write_atomically(path, |writer| writer.write_all(&archive).map_err(failed))?;
            }
            _ => return Err(SensorError::UnknownFormat { path: path.to_owned() }),
        }
        Ok(())
    }

    fn write_ply(&self, writer: &mut impl Write) -> std::io::Result<()> {
        writeln!(writer, "ply\nformat binary_little_endian 1.0\nelement vertex {}", self.len())?;
        for property in ["float x", "float y", "float z", "float range", "float intensity", "ushort channel"]
        {
            writeln!(writer, "property {property}")?;
        }
        writeln!(writer, "property uint firing\nproperty uint instance\nend_header")?;
        for i in 0..self.len() {
            let [x, y, z] = self.positions[i];
            for number in [x, y, z, self.ranges[i], self.intensities[i]] {
                writer.write_all(&number.to_le_bytes())?;
            }
            writer.write_all(&self.channels[i].to_le_bytes())?;
            writer.write_all(&self.firings[i].to_le_bytes())?;
            writer.write_all(&self.instances[i].to_le_bytes())?;
        }
        Ok(())
    }

    fn npz(&self) -> std::io::Result<Vec<u8>> {
        let (mut archive, n) = (Npz::new(), self.len());
        archive.add("positions", &[n, 3], self.positions.as_flattened())?;
        archive.add("ranges", &[n], &self.ranges)?;
        archive.add("intensities", &[n], &self.intensities)?;
        archive.add("channels", &[n], &self.channels)?;
        archive.add("firings", &[n], &self.firings)?;
        archive.add("instances", &[n], &self.instances)?;
        archive.finish()
    }
}
