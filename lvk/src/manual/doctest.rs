// The context of a documentation test: as `doctest_of_desc.rs`, with the default description.
{
    let desc = lvk::ContextDesc::default();
    include!("doctest_of_desc.rs")
}
