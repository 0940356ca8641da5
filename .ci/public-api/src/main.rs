//! Prints the public items in a JSON file of rustdoc, one a line: `public-api-list FILE`.

/// Automatic traits without a meaning for users of the library, and a trait that comes with another.
const UNUSED: [&str; 6] =
    ["Freeze", "RefUnwindSafe", "StructuralPartialEq", "Unpin", "UnsafeUnpin", "UnwindSafe"];
/// Functions of common traits, which the line of the trait stands for.
const OF_TRAITS: [&str; 7] = ["clone", "cmp", "default", "eq", "fmt", "hash", "partial_cmp"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let json = std::env::args_os().nth(1).ok_or("name the JSON file of rustdoc")?;
    let api = public_api::Builder::from_rustdoc_json(json).omit_blanket_impls(true).build()?;
    for item in api.items() {
        let line = item.to_string();
        let trait_name =
            line.strip_prefix("impl").and_then(|rest| rest.split_once(" for ")).map(|(name, _)| name);
        let is_unused =
            trait_name.is_some_and(|name| UNUSED.iter().any(|unused| name.ends_with(&format!("::{unused}"))));
        let head = line.split('(').next().unwrap_or_default();
        let is_of_trait = OF_TRAITS
            .iter()
            .any(|name| head.ends_with(&format!("::{name}")) || head.contains(&format!("::{name}<__")));
        if !is_unused && !is_of_trait {
            println!("{line}");
        }
    }
    Ok(())
}
