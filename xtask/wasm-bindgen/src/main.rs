//! Makes a page's JavaScript and its WebAssembly of what was compiled: `alhazen-wasm-bindgen IN.wasm OUT-FOLDER`.

use anyhow::{Context, bail};
use wasm_bindgen_cli_support::Bindgen;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let [input, folder] = &arguments[..] else { bail!("give the compiled file and a folder") };
    Bindgen::new()
        .input_path(input)
        .out_name("alhazen")
        .web(true)?
        .typescript(true)
        .remove_name_section(true)
        .remove_producers_section(true)
        .generate(folder)
        .with_context(|| format!("cannot make JavaScript of {input}"))
}
