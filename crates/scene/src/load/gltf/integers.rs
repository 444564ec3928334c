//! Integers that were written as `1.0`.

use elementary::powi;
use serde_json::{Number, Value};

/// Larger files are not mended: the generic form of JSON takes many times its text.
const MAX_MENDED: usize = 64 << 20;

/// The same JSON with whole numbers written without a fraction, as the typed form expects them. `None` if it is not
/// valid JSON or too large.
///
/// The specification forbids such numbers, but languages with a single type for numbers write them.
pub(super) fn mend(json: &[u8]) -> Option<Vec<u8>> {
    if json.len() > MAX_MENDED {
        return None;
    }
    let mut value: Value = serde_json::from_slice(json).ok()?;
    mend_value(&mut value);
    serde_json::to_vec(&value).ok()
}

/// The recursion is as deep as the parser allowed the text to be: 128 levels.
fn mend_value(value: &mut Value) {
    match value {
        Value::Array(values) => values.iter_mut().for_each(mend_value),
        Value::Object(fields) => fields.values_mut().for_each(mend_value),
        Value::Number(number) => {
            let whole =
                number.as_f64().filter(|f| number.is_f64() && f.fract() == 0.0 && f.abs() < powi(2f64, 53));
            if let Some(whole) = whole {
                *number = Number::from(whole as i64);
            }
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_numbers_change() {
        let mended = mend(br#"{"a":[1.0,-2.0,0.5,1e300,3],"b":"1.0"}"#).unwrap();
        let expected = br#"{"a":[1,-2,0.5,1e+300,3],"b":"1.0"}"#;
        assert_eq!(String::from_utf8_lossy(&mended), String::from_utf8_lossy(expected));
        assert!(mend(b"{").is_none());
    }
}
