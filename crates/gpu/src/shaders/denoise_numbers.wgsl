// Numbers that the denoiser's layers hand on: 16-bit floats where the device has them.

#ifdef DENOISE_HALF
enable f16;

alias Number = f16;
alias Quad = vec4<f16>;
/// The largest number that is handed on.
const LARGEST_NUMBER: f32 = 65504.0;
#else
alias Number = f32;
alias Quad = vec4<f32>;
/// The largest number that is handed on.
const LARGEST_NUMBER: f32 = 3e38;
#endif
