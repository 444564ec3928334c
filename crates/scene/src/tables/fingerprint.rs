//! A hash of a scene's tables, so that two machines can tell whether they render the same.

use super::{EnvironmentTable, SceneTables};
use bytemuck::NoUninit;
use std::fmt::{self, Debug, Write};

impl SceneTables {
    /// A hash of everything that back ends read, as 32 hexadecimal digits.
    ///
    /// It depends on contents only: names and places of files do not matter, nor does how the scene was made.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        let mut hash = Fingerprint(blake3::Hasher::new());
        // Without `..`, so that no table can be forgotten.
        let Self {
            positions,
            normals,
            tangents,
            uv0,
            uv1,
            colors,
            indices,
            spheres,
            geometries,
            blas,
            instances,
            bindings,
            placements,
            materials,
            layers,
            layer_textures,
            media,
            grids,
            densities,
            fog,
            nested,
            textures,
            graph_nodes,
            graph_textures,
            texels,
            lights,
            primitive_lights,
            profiles,
            light_alias,
            light_tree,
            // They follow from the rest.
            emitter_boxes: _,
            has_dynamic_instances: _,
            environment,
            bounding_sphere,
            has_alpha,
            motion,
        } = self;
        hash.numbers(positions);
        hash.numbers(normals);
        hash.numbers(tangents);
        hash.numbers(uv0);
        hash.numbers(uv1);
        hash.numbers(colors);
        hash.numbers(indices);
        hash.numbers(spheres);
        hash.records(geometries);
        hash.records(blas);
        hash.records(instances);
        hash.records(bindings);
        hash.numbers(placements.as_flattened());
        hash.records(materials);
        hash.records(layers);
        hash.records(layer_textures);
        hash.records(&(media, grids, fog, nested));
        hash.numbers(densities);
        hash.records(textures);
        hash.records(&(graph_nodes, graph_textures));
        hash.numbers(texels);
        hash.records(lights);
        hash.numbers(primitive_lights);
        hash.numbers(profiles);
        hash.numbers(light_alias);
        hash.numbers(&light_tree.nodes);
        hash.numbers(&light_tree.places);
        hash.records(&(light_tree.defends_root, light_tree.uniform_share));
        hash.environment(environment);
        hash.records(&(bounding_sphere, has_alpha));
        // Scenes that stand still keep the fingerprint that they had before anything could move.
        if let Some(motion) = motion {
            hash.records(motion);
        }
        hash.0.finalize().to_hex()[..32].to_owned()
    }
}

struct Fingerprint(blake3::Hasher);

impl Fingerprint {
    /// A table of plain numbers, by its bytes.
    fn numbers<T: NoUninit>(&mut self, table: &[T]) {
        self.0.update(&(table.len() as u64).to_le_bytes());
        self.0.update(bytemuck::cast_slice(table));
    }

    /// Records with padding or enums, by the text of all their fields, which says every number exactly.
    fn records(&mut self, table: &(impl Debug + ?Sized)) {
        // Writing to a hash cannot fail.
        let _ = write!(self, "{table:?};");
    }

    fn environment(&mut self, table: &EnvironmentTable) {
        let EnvironmentTable {
            horizon,
            zenith,
            ground,
            width,
            height,
            rotation,
            texels,
            row_alias,
            alias,
            portals,
            light,
        } = table;
        self.records(&(horizon, zenith, ground, width, height, rotation, light));
        self.numbers(texels);
        self.numbers(row_alias);
        self.numbers(alias);
        self.numbers(portals);
    }
}

impl Write for Fingerprint {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_contents_have_equal_fingerprints_and_every_change_shows() {
        let load = |name: &str| {
            let loaded = crate::builtin::load(name, &Default::default(), &Default::default()).unwrap();
            SceneTables::build(&loaded.scene)
        };
        let tables = load("material-grid");
        assert_eq!(tables.fingerprint(), load("material-grid").fingerprint());
        assert_eq!(tables.fingerprint().len(), 32);
        let changes: [fn(&mut SceneTables); 12] = [
            |t| t.positions[0][1] += 1e-7,
            |t| t.indices.swap(0, 1),
            |t| t.materials[0].roughness += 1e-6,
            |t| t.instances[0].object_to_world[0][0] *= 1.0 + f32::EPSILON,
            |t| t.lights[0].visible = !t.lights[0].visible,
            |t| t.primitive_lights.push(0),
            |t| t.profiles.push(1),
            |t| t.has_alpha = !t.has_alpha,
            |t| t.environment.zenith[2] += 0.1,
            |t| t.environment.portals.push(Default::default()),
            |t| t.bounding_sphere[3] += 1.0,
            |t| t.fog.top = 3.0,
        ];
        let mut seen = vec![tables.fingerprint(), load("cornell").fingerprint()];
        for change in changes {
            let mut other = tables.clone();
            change(&mut other);
            seen.push(other.fingerprint());
        }
        let mut unique = seen.clone();
        unique.sort();
        unique.dedup();
        assert_eq!(unique.len(), seen.len());
    }
}
