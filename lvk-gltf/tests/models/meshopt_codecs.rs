//! meshopt_codecs
