//! Edits of the JSON of models: mutated numbers, missing and repeated parts, values in the place of others.

use serde_json::{Value, json};

/// Models of the corpus, each with other features.
const MODELS: [&[u8]; 8] = [
    include_bytes!("../corpus/gltf/rich.glb"),
    include_bytes!("../corpus/gltf/skin.glb"),
    include_bytes!("../corpus/gltf/morph.glb"),
    include_bytes!("../corpus/gltf/instances.glb"),
    include_bytes!("../corpus/gltf/sparse.glb"),
    include_bytes!("../corpus/gltf/cubic.glb"),
    include_bytes!("../corpus/gltf/bc7.glb"),
    include_bytes!("../corpus/gltf/jpeg.glb"),
];

/// Bytes of the headers of a file and of its first chunk.
const HEADERS: usize = 12 + 8;
/// Most edits of a model.
const MOST_EDITS: usize = 8;

/// Returns the `.glb` of an input whose first byte is below 16: the model of that number, after edits of four bytes each. The first
/// two choose a value, the third what becomes of it, and the fourth by what. `None` for other inputs.
pub(crate) fn edited_model(bytes: &[u8]) -> Option<Vec<u8>> {
    let (model, edits) = bytes.split_first().filter(|(first, _)| **first < 16)?;
    let (json, binary) = parts_of(MODELS[usize::from(*model) % MODELS.len()])?;
    let mut json: Value = serde_json::from_slice(json).ok()?;
    let mut binary = binary.to_vec();
    for [low, high, kind, value] in edits.as_chunks().0.iter().copied().take(MOST_EDITS) {
        let place = u16::from_le_bytes([low, high]);
        if kind % 8 == 7 {
            let at = usize::from(place) % binary.len().max(1);
            binary.iter_mut().skip(at).take(1).for_each(|byte| *byte = value);
        } else {
            edit_json(&mut json, place, kind % 8, value);
        }
    }
    Some(file_of(json.to_string().into_bytes(), binary))
}

/// Returns the JSON and the binary chunk of a whole file.
fn parts_of(file: &[u8]) -> Option<(&[u8], &[u8])> {
    let length = u32::from_le_bytes(*file.get(12..)?.first_chunk()?) as usize;
    let (json, rest) = file.get(HEADERS..)?.split_at_checked(length)?;
    Some((json, rest.get(8..).unwrap_or_default()))
}

fn file_of(mut json: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let number = |number: usize| (number as u32).to_le_bytes();
    let length = HEADERS + 8 + json.len() + binary.len();
    let mut file = [b"glTF\x02\0\0\0", &number(length)[..], &number(json.len()), b"JSON", &json].concat();
    file.extend([&number(binary.len())[..], b"BIN\0", &binary].concat());
    file
}

/// Numbers at which readers decide.
fn number(choice: u8) -> Value {
    const WHOLE: [i64; 12] = [0, 1, 2, 3, 4, 7, 255, 65_535, -1, 0x7fff_ffff, 0xffff_ffff, i64::MAX];
    const OTHER: [f64; 4] = [0.5, -0.5, 1e-40, 1e39];
    match choice % 16 {
        whole @ 0..12 => json!(WHOLE[usize::from(whole)]),
        other => json!(OTHER[usize::from(other - 12)]),
    }
}

/// Edits the value number `place` of the tree, in the order of the text.
fn edit_json(json: &mut Value, place: u16, kind: u8, choice: u8) {
    let all = pointers(json, String::new());
    let count = all.len();
    let Some(pointer) = all.get(usize::from(place) % count.max(1)) else { return };
    let other =
        all.get(usize::from(choice) * 31 % count.max(1)).and_then(|other| json.pointer(other)).cloned();
    let Some(target) = json.pointer_mut(pointer) else { return };
    match kind {
        // Numbers are what readers trust, so most edits change them.
        0..=2 if target.is_number() => *target = number(choice),
        3 => *target = other.unwrap_or_default(),
        4 => {
            *target =
                [json!(null), json!([]), json!({}), json!(""), json!(true)][usize::from(choice) % 5].clone();
        }
        5 => remove_one(target, choice),
        6 => repeat_one(target, choice),
        _ => {}
    }
}

/// Returns the JSON pointers (RFC 6901) of a value and of all below it.
fn pointers(value: &Value, own: String) -> Vec<String> {
    let mut all = Vec::new();
    match value {
        Value::Array(list) => {
            for (at, item) in list.iter().enumerate() {
                all.extend(pointers(item, format!("{own}/{at}")));
            }
        }
        Value::Object(map) => {
            for (name, item) in map {
                let name = name.replace('~', "~0").replace('/', "~1");
                all.extend(pointers(item, format!("{own}/{name}")));
            }
        }
        _ => {}
    }
    all.push(own);
    all
}

fn remove_one(value: &mut Value, choice: u8) {
    match value {
        Value::Array(list) if !list.is_empty() => drop(list.remove(usize::from(choice) % list.len())),
        Value::Object(map) => {
            let name = map.keys().nth(usize::from(choice) % map.len().max(1)).cloned();
            name.and_then(|name| map.remove(&name));
        }
        _ => {}
    }
}

fn repeat_one(value: &mut Value, choice: u8) {
    if let Value::Array(list) = value
        && !list.is_empty()
    {
        list.push(list[usize::from(choice) % list.len()].clone());
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use super::*;

    #[test]
    fn a_model_without_edits_has_the_same_parts() {
        for (number, model) in (0..).zip(MODELS) {
            let file = edited_model(&[number]).unwrap();
            let ((json, binary), (own_json, own_binary)) =
                (parts_of(&file).unwrap(), parts_of(model).unwrap());
            let value = |text| serde_json::from_slice::<Value>(text).unwrap();
            assert_eq!(value(json), value(own_json));
            assert_eq!(binary, own_binary);
            assert_eq!(file.len() as u32, u32::from_le_bytes(file[8..12].try_into().unwrap()));
        }
        assert_eq!(edited_model(b"glTF"), None);
        assert_eq!(edited_model(b""), None);
    }

    #[test]
    fn edits_change_the_value_that_they_choose() {
        let tree = || json!({ "a": [1, 2], "b/c": { "d": 3 } });
        assert_eq!(pointers(&tree(), String::new()), ["/a/0", "/a/1", "/a", "/b~1c/d", "/b~1c", ""]);
        let edited = |place, kind, choice| {
            let mut json = tree();
            edit_json(&mut json, place, kind, choice);
            json
        };
        assert_eq!(edited(1, 0, 8), json!({ "a": [1, -1], "b/c": { "d": 3 } }));
        assert_eq!(edited(3, 4, 0), json!({ "a": [1, 2], "b/c": { "d": null } }));
        assert_eq!(edited(2, 5, 1), json!({ "a": [1], "b/c": { "d": 3 } }));
        assert_eq!(edited(2, 6, 0), json!({ "a": [1, 2, 1], "b/c": { "d": 3 } }));
        assert_eq!(edited(5, 5, 0), json!({ "b/c": { "d": 3 } }));
        assert_eq!(edited(4, 3, 2), json!({ "a": [1, 2], "b/c": [1, 2] }));
    }
}
