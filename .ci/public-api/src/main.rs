//! Prints the public items in a JSON file of rustdoc, one a line: `public-api-list FILE`.

/// Automatic traits without a meaning for users of the library.
const UNUSED: [&str; 5] = ["Freeze", "RefUnwindSafe", "Unpin", "UnsafeUnpin", "UnwindSafe"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let json = std::env::args_os().nth(1).ok_or("name the JSON file of rustdoc")?;
    let api = public_api::Builder::from_rustdoc_json(json)
        .omit_blanket_impls(true)
        .omit_auto_derived_impls(true)
        .build()?;
    for item in api.items() {
        let line = item.to_string();
        let trait_name =
            line.strip_prefix("impl").and_then(|rest| rest.split_once(" for ")).map(|(name, _)| name);
        let is_unused =
            trait_name.is_some_and(|name| UNUSED.iter().any(|unused| name.ends_with(&format!("::{unused}"))));
        if !is_unused {
            println!("{line}");
        }
    }
    Ok(())
}
