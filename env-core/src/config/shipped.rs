//! The scenario files that every build carries.

/// Name and text of each shipped scenario.
pub const SHIPPED: [(&str, &str); 4] = [
    ("default", include_str!("../../../configs/default.toml")),
    ("pasture", include_str!("../../../configs/pasture.toml")),
    ("cowbot-field", include_str!("../../../configs/cowbot-field.toml")),
    ("table1", include_str!("../../../configs/table1.toml")),
];

/// The text of the shipped scenario of that name.
#[must_use]
pub fn shipped(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text)
}
