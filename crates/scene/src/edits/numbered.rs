//! Maps whose keys are numbers, in formats whose keys are strings.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;

pub(super) fn serialize<T: Serialize, S: Serializer>(
    map: &BTreeMap<u32, T>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(map.iter().map(|(id, value)| (id.to_string(), value)))
}

pub(super) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<BTreeMap<u32, T>, D::Error> {
    let named = BTreeMap::<String, T>::deserialize(deserializer)?;
    let numbered = named.into_iter().map(|(name, value)| {
        let id = name.parse().map_err(|_| D::Error::custom(format!("`{name}` is not a number")))?;
        Ok((id, value))
    });
    numbered.collect()
}
