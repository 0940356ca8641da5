// The context of a documentation test, from its variable `desc`. `LVK_TEST_LIBRARY` names a Vulkan loader. Without that
// variable, a test on a machine without a device ends here, and passes.
{
    let library = std::env::var_os("LVK_TEST_LIBRARY").map(std::path::PathBuf::from);
    match lvk::Context::new(&lvk::ContextDesc { vulkan_library: library.as_deref(), ..desc }) {
        Err(error @ (lvk::Error::NoVulkan { .. } | lvk::Error::NoDevice { .. })) if library.is_none() => {
            eprintln!("NOT TESTED, there is no device: {error}");
            return Ok(());
        }
        context => context?,
    }
}
