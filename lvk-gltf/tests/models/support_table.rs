//! support_table
