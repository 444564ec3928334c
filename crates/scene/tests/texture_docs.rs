//! `docs/textures.md` names what there is.

use scene::texture_graph::KINDS;

#[test]
fn every_node_and_its_keys_are_documented() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/textures.md");
    let page = std::fs::read_to_string(path).expect("the page");
    for kind in KINDS {
        let name = format!("`{}`", kind.name);
        let row = page
            .lines()
            .find(|line| line.starts_with('|') && line.split('|').nth(1).unwrap().contains(&name));
        let row = row.unwrap_or_else(|| panic!("{name} has no row"));
        let keys = kind.inputs.iter().map(|i| i.name).chain(kind.parameters.iter().map(|p| p.name));
        for key in keys {
            assert!(row.contains(&format!("`{key}")), "{name}: `{key}` is not in its row");
        }
        for choice in kind.parameters.iter().filter(|p| p.choices.len() > 2).flat_map(|p| p.choices) {
            assert!(row.contains(&format!("\"{choice}\"")), "{name}: {choice} is not in its row");
        }
    }
}
