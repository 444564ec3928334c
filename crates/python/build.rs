//! What an extension module needs of the linker: on macOS, symbols that the interpreter will provide.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
