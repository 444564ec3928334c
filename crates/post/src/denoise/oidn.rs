//! Intel Open Image Denoise, if it is installed: found when the program runs, never linked, never fetched.
//!
//! The library's C interface is the same from version 1.4 to 2.x but for the name of one function.

use super::{NoisyPicture, SizesDiffer};
use film::Image;
use libloading::{Library, Symbol};
use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};

/// Names under which it is looked for, the newest first.
const NAMES: &[&str] = if cfg!(windows) {
    &["OpenImageDenoise.dll"]
} else if cfg!(target_os = "macos") {
    &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.1.dylib", "libOpenImageDenoise.dylib"]
} else {
    &["libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1", "libOpenImageDenoise.so"]
};

/// `OIDN_DEVICE_TYPE_CPU`: its devices take pictures where they are.
const DEVICE_CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FORMAT_FLOAT3: c_int = 3;

type Handle = *mut c_void;
type NewDevice = unsafe extern "C" fn(c_int) -> Handle;
type OfHandle = unsafe extern "C" fn(Handle);
type NewFilter = unsafe extern "C" fn(Handle, *const c_char) -> Handle;
type SetImage =
    unsafe extern "C" fn(Handle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);
type SetBool = unsafe extern "C" fn(Handle, *const c_char, bool);
type GetError = unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int;

/// Why Open Image Denoise did not denoise.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OidnError {
    /// No library of a known name could be loaded.
    #[error("Open Image Denoise is not installed ({tried})")]
    NotFound {
        /// Where it was looked for, and what the system said.
        tried: String,
    },
    /// The library lacks a function.
    #[error("{} is no Open Image Denoise 1.4 or later", path.display())]
    Foreign {
        /// The library.
        path: PathBuf,
        /// What is missing.
        source: libloading::Error,
    },
    /// The images are not of one picture.
    #[error(transparent)]
    Sizes(#[from] SizesDiffer),
    /// The library refused.
    #[error("Open Image Denoise failed: {reason}")]
    Failed {
        /// Its words.
        reason: String,
    },
}

/// The loaded library.
#[derive(Debug)]
pub struct Oidn {
    library: Library,
    path: PathBuf,
}

impl Oidn {
    /// Loads the library from where the system looks for libraries, or from what the environment variable `ALHAZEN_OIDN`
    /// names.
    ///
    /// # Errors
    /// [`OidnError::NotFound`].
    pub fn find() -> Result<Self, OidnError> {
        match std::env::var_os("ALHAZEN_OIDN") {
            Some(path) => Self::load(&[PathBuf::from(path)]),
            None => Self::load(&NAMES.iter().map(PathBuf::from).collect::<Vec<_>>()),
        }
    }

    /// Loads the first that can be loaded.
    fn load(paths: &[PathBuf]) -> Result<Self, OidnError> {
        let mut tried = Vec::new();
        for path in paths {
            // SAFETY: loading runs the library's own initialisation, which the user trusts by having it installed.
            match unsafe { Library::new(path) } {
                Ok(library) => return Ok(Self { library, path: path.clone() }),
                Err(error) => tried.push(error.to_string()),
            }
        }
        Err(OidnError::NotFound { tried: tried.join("; ") })
    }

    /// The file that was loaded.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The picture without its noise.
    ///
    /// # Errors
    /// [`OidnError::Sizes`], [`OidnError::Foreign`] and [`OidnError::Failed`].
    pub fn denoise(&self, picture: &NoisyPicture) -> Result<Image, OidnError> {
        picture.input()?;
        let (width, height) = (picture.colour.width(), picture.colour.height());
        // Rows of three floats each, which stay where they are until the filter has run.
        let mut inputs = [&picture.colour, &picture.albedo, &picture.normal].map(Image::to_rgb);
        let mut output = Image::black(width, height, 3);
        let new_device: Symbol<NewDevice> = self.function(c"oidnNewDevice")?;
        let commit_device: Symbol<OfHandle> = self.function(c"oidnCommitDevice")?;
        let release_device: Symbol<OfHandle> = self.function(c"oidnReleaseDevice")?;
        let new_filter: Symbol<NewFilter> = self.function(c"oidnNewFilter")?;
        let set_image: Symbol<SetImage> = self.function(c"oidnSetSharedFilterImage")?;
        let set_bool: Symbol<SetBool> =
            self.function(c"oidnSetFilterBool").or_else(|_| self.function(c"oidnSetFilter1b"))?;
        let commit_filter: Symbol<OfHandle> = self.function(c"oidnCommitFilter")?;
        let execute_filter: Symbol<OfHandle> = self.function(c"oidnExecuteFilter")?;
        let release_filter: Symbol<OfHandle> = self.function(c"oidnReleaseFilter")?;
        let get_error: Symbol<GetError> = self.function(c"oidnGetDeviceError")?;
        // SAFETY: the functions have the signatures of `oidn.h`; handles come from the library and are released once;
        // images are as large as said and outlive the filter; a null device or filter goes to no function but those for
        // errors, which take null.
        unsafe {
            let device = new_device(DEVICE_CPU);
            if device.is_null() {
                return Err(OidnError::Failed { reason: last_error(&get_error, device) });
            }
            commit_device(device);
            let filter = new_filter(device, c"RT".as_ptr());
            if !filter.is_null() {
                let (w, h) = (width as usize, height as usize);
                let set = |name: &CStr, image: &mut Image| {
                    let data = image.data_mut().as_mut_ptr().cast();
                    set_image(filter, name.as_ptr(), data, FORMAT_FLOAT3, w, h, 0, 0, 0);
                };
                let [colour, albedo, normal] = &mut inputs;
                set(c"color", colour);
                set(c"albedo", albedo);
                set(c"normal", normal);
                set(c"output", &mut output);
                set_bool(filter, c"hdr".as_ptr(), true);
                commit_filter(filter);
                execute_filter(filter);
                release_filter(filter);
            }
            let reason = last_error(&get_error, device);
            release_device(device);
            if filter.is_null() || !reason.is_empty() {
                Err(OidnError::Failed { reason })
            } else {
                Ok(output)
            }
        }
    }

    fn function<T>(&self, name: &CStr) -> Result<Symbol<'_, T>, OidnError> {
        // SAFETY: the caller asks for the type that `oidn.h` gives the function.
        unsafe { self.library.get(name.to_bytes_with_nul()) }
            .map_err(|source| OidnError::Foreign { path: self.path.clone(), source })
    }
}

/// The library's message about its last error; empty if there was none.
///
/// # Safety
/// `device` is null or a live device of the library of `get_error`.
unsafe fn last_error(get_error: &GetError, device: Handle) -> String {
    let mut message: *const c_char = std::ptr::null();
    // SAFETY: as the caller promises; the message lives until the next call.
    unsafe {
        if get_error(device, &mut message) == 0 {
            return String::new();
        }
        if message.is_null() {
            "no reason given".into()
        } else {
            CStr::from_ptr(message).to_string_lossy().into()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_there_is_an_error_that_says_where_it_was_looked_for() {
        let error = Oidn::load(&[PathBuf::from("/no/such/libOpenImageDenoise.so")]).expect_err("not there");
        assert!(error.to_string().contains("/no/such/libOpenImageDenoise.so"), "{error}");
    }

    /// Any library will do to see that functions are looked for before they are called.
    #[cfg(target_os = "linux")]
    #[test]
    fn another_library_is_an_error() {
        let Ok(other) = Oidn::load(&[PathBuf::from("libc.so.6"), PathBuf::from("libm.so.6")]) else { return };
        let image = Image::black(2, 2, 3);
        let picture =
            NoisyPicture { colour: image.clone(), variance: None, albedo: image.clone(), normal: image };
        assert!(matches!(other.denoise(&picture), Err(OidnError::Foreign { .. })));
    }
}
