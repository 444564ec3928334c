//! How pictures are stored.

use alhazen::output::Encoding;
use alhazen::{ExrCompression, Precision};
use clap::{Args, ValueEnum};

/// Options of the files that are written.
#[derive(Debug, Clone, Default, Args)]
pub struct OutputArgs {
    /// Bits of colour in EXR files: half (16, up to 65504) or float (32). Layers of positions and depths always have 32.
    #[arg(long, help_heading = "Output", value_enum, value_name = "BITS")]
    exr_precision: Option<PrecisionName>,
    /// Compression of EXR files; all of them are lossless.
    #[arg(long, help_heading = "Output", value_enum, value_name = "NAME")]
    exr_compression: Option<CompressionName>,
    /// Bits of each channel in PNG files: 8 or 16.
    #[arg(long, help_heading = "Output", value_name = "BITS", value_parser = parse_png_bits)]
    png_bits: Option<u8>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PrecisionName {
    /// 16 bits.
    Half,
    /// 32 bits.
    Float,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum CompressionName {
    /// Not at all.
    None,
    /// Run lengths.
    Rle,
    /// Deflate.
    Zip,
    /// Wavelets: best for noisy pictures.
    Piz,
}

fn parse_png_bits(text: &str) -> Result<u8, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        _ => Err("expected 8 or 16".into()),
    }
}

impl OutputArgs {
    /// What they ask for.
    pub fn encoding(&self) -> Encoding {
        let default = Encoding::default();
        Encoding {
            exr_precision: match self.exr_precision {
                None => default.exr_precision,
                Some(PrecisionName::Half) => Precision::Half,
                Some(PrecisionName::Float) => Precision::Float,
            },
            exr_compression: match self.exr_compression {
                None => default.exr_compression,
                Some(CompressionName::None) => ExrCompression::None,
                Some(CompressionName::Rle) => ExrCompression::Rle,
                Some(CompressionName::Zip) => ExrCompression::Zip,
                Some(CompressionName::Piz) => ExrCompression::Piz,
            },
            png16: self.png_bits == Some(16),
        }
    }
}
