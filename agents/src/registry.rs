//! Every agent by its name, with its options.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::Serialize;
use swath_core::config::{ConfigError, from_table, hint};
use swath_core::geometry::Point;
use toml::{Table, Value};

use crate::agent::{Agent, Capped};
use crate::greedy::{Greedy, GreedyOptions};
use crate::horizon::{Clairvoyant, ClairvoyantOptions, Horizon, HorizonOptions};
use crate::learned::Learned;
use crate::routing::{Bcp, BcpOptions, BcpTsp, Jump, React, Snake};
use crate::tracker::{TRACKING_MARGIN_M, Tracker};

/// An agent of the registry: its name, and what it does in one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    /// The name in commands and result files.
    pub name: &'static str,
    /// What it does.
    pub about: &'static str,
    /// Whether its own choices are random.
    pub is_random: bool,
    /// Whether it sees only what the mower may know; if not, it is a yardstick, told where the weeds stand.
    pub is_online: bool,
}

/// Every agent, in the order in which tables list them.
pub const AGENTS: &[Entry] = &[
    Entry {
        name: "bcp",
        about: "boustrophedon path over everything; option spacing = deck | sensor",
        is_random: false,
        is_online: true,
    },
    Entry {
        name: "bcp-tsp",
        about: "search sweep, then a tour through the weeds it found",
        is_random: false,
        is_online: true,
    },
    Entry {
        name: "react",
        about: "random search; weeds in the order of their detection",
        is_random: true,
        is_online: true,
    },
    Entry {
        name: "jump",
        about: "JUMP: passes with detours to weeds above, spring spacing",
        is_random: false,
        is_online: true,
    },
    Entry {
        name: "snake",
        about: "SNAKE: passes that wriggle from weed to weed",
        is_random: false,
        is_online: true,
    },
    Entry {
        name: "r-snake",
        about: "R-SNAKE: SNAKE that leaves weeds far below behind",
        is_random: false,
        is_online: true,
    },
    Entry {
        name: "greedy",
        about: "search sweep, and each weed that is a short detour; option detour_m",
        is_random: false,
        is_online: true,
    },
    Entry {
        name: "horizon",
        about: "one plan over all that is known, made anew as more is known; options iterations, time_ms, bar_margin_m",
        is_random: false,
        is_online: true,
    },
    Entry {
        name: "learned",
        about: "a trained network that chooses among places to go to",
        is_random: false,
        is_online: true,
    },
    Entry {
        name: "clairvoyant",
        about: "NOT an online agent, a yardstick: a tour of all weeds, which it is told; option iterations",
        is_random: false,
        is_online: false,
    },
];

/// An agent's name and options, checked: `bcp`, `bcp:spacing=sensor`. An option with the value that it has anyway is left out
/// of the label, so one agent has one label, however it was written.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentSpec {
    label: String,
    build: Build,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
enum Build {
    Bcp(BcpOptions),
    BcpTsp,
    React,
    Jump,
    Snake,
    RSnake,
    Greedy(GreedyOptions),
    Horizon(HorizonOptions),
    Learned,
    Clairvoyant(ClairvoyantOptions),
}

impl Build {
    fn of(name: &str, options: Table) -> Result<Self, ConfigError> {
        let prefix = format!("{name}.");
        Ok(match name {
            "bcp" => Build::Bcp(from_table(options, &prefix)?),
            "bcp-tsp" => plain(options, &prefix, Build::BcpTsp)?,
            "react" => plain(options, &prefix, Build::React)?,
            "jump" => plain(options, &prefix, Build::Jump)?,
            "snake" => plain(options, &prefix, Build::Snake)?,
            "r-snake" => plain(options, &prefix, Build::RSnake)?,
            "greedy" => {
                let options: GreedyOptions = from_table(options, &prefix)?;
                Build::Greedy(options.checked()?)
            }
            "horizon" => {
                let options: HorizonOptions = from_table(options, &prefix)?;
                Build::Horizon(options.checked()?)
            }
            "learned" => plain(options, &prefix, Build::Learned)?,
            "clairvoyant" => {
                let options: ClairvoyantOptions = from_table(options, &prefix)?;
                Build::Clairvoyant(options.checked()?)
            }
            _ => {
                let names: Vec<&str> = AGENTS.iter().map(|entry| entry.name).collect();
                let hint = hint(name, &names);
                let expected = format!("one of {}", names.join(", "));
                return Err(ConfigError::value("agent", expected, format!("`{name}`{hint}")));
            }
        })
    }

    /// Every option with its value.
    fn options(&self) -> Table {
        match Value::try_from(self).expect("every option has a TOML form") {
            Value::Table(variant) => {
                variant.into_iter().find_map(|(_, options)| options.try_into().ok())
            }
            _ => None,
        }
        .unwrap_or_default()
    }
}

/// The options of an agent that has none.
#[derive(Debug, Clone, Copy, Default, serde::Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct NoOptions {}

impl AgentSpec {
    /// The agent called `name` with `options`.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] naming an unknown agent, option or value.
    pub fn new(name: &str, options: Table) -> Result<Self, ConfigError> {
        let build = Build::of(name, options)?;
        let label = label(name, &build.options(), &Build::of(name, Table::new())?.options());
        Ok(Self { label, build })
    }

    /// Whether the agent sees only what the mower may know.
    #[must_use]
    pub fn is_online(&self) -> bool {
        !matches!(self.build, Build::Clairvoyant(_))
    }

    /// The same agent, if it can act where it is told nothing but what the mower knows.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] naming a yardstick.
    pub fn online(&self) -> Result<&Self, ConfigError> {
        if self.is_online() {
            return Ok(self);
        }
        let expected = "an online agent where it acts in an environment: it would have to be told where the weeds stand";
        Err(ConfigError::value("agent", expected, format!("`{self}`")))
    }

    /// A fresh agent for an instance with these weeds, world frame, metres, of which only a yardstick is told.
    #[must_use]
    pub fn build_for(&self, seed: u64, weeds: &[Point]) -> Box<dyn Agent> {
        match self.build {
            Build::Clairvoyant(options) => {
                Box::new(Capped(Box::new(Clairvoyant::new(options, weeds))))
            }
            _ => self.build(seed),
        }
    }

    /// A fresh agent with its safety cap; `seed` is for its own choices, if it makes any at random.
    ///
    /// # Panics
    ///
    /// For a yardstick; see [`AgentSpec::online`].
    #[must_use]
    pub fn build(&self, seed: u64) -> Box<dyn Agent> {
        let agent: Box<dyn Agent> = match self.build {
            Build::Bcp(options) => Box::new(Bcp::new(options)),
            Build::BcpTsp => Box::new(BcpTsp::new()),
            Build::React => Box::new(React::new(seed)),
            Build::Jump => Box::new(Jump::new()),
            Build::Snake => Box::new(Snake::new()),
            Build::RSnake => Box::new(Snake::restricted()),
            Build::Greedy(options) => Box::new(Greedy::new(options)),
            Build::Horizon(options) => Box::new(Horizon::new(options)),
            Build::Learned => Box::new(Learned::new()),
            Build::Clairvoyant(_) => panic!("a yardstick is built for the weeds of an instance"),
        };
        Box::new(Capped(agent))
    }

    /// The same agent for a mower that is told one curvature a control period.
    ///
    /// `bcp` is followed without a margin: a narrower deck would only give it more passes, and on straights the mower keeps
    /// to the path.
    #[must_use]
    pub fn build_tracked(&self, seed: u64) -> Box<dyn Agent> {
        let margin_m = if matches!(self.build, Build::Bcp(_)) { 0.0 } else { TRACKING_MARGIN_M };
        Box::new(Tracker::new(self.build(seed), margin_m))
    }
}

/// An agent without options.
fn plain(options: Table, prefix: &str, build: Build) -> Result<Build, ConfigError> {
    from_table::<NoOptions>(options, prefix).map(|_| build)
}

/// The name, and the options whose values are not the default ones.
fn label(name: &str, options: &Table, defaults: &Table) -> String {
    let is_chosen = |(key, value): &(&String, &Value)| defaults.get(key.as_str()) != Some(*value);
    options.iter().filter(is_chosen).fold(name.to_owned(), |label, (key, value)| {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        format!("{label}:{key}={value}")
    })
}

impl fmt::Display for AgentSpec {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(&self.label)
    }
}

/// Reads `name` or `name:key=value:key=value`.
impl FromStr for AgentSpec {
    type Err = ConfigError;

    fn from_str(text: &str) -> Result<Self, ConfigError> {
        let mut parts = text.trim().split(':');
        let name = parts.next().unwrap_or_default();
        let mut options = Table::new();
        for part in parts {
            let Some((key, value)) = part.split_once('=') else {
                return Err(ConfigError::value(
                    "agent",
                    "written `name` or `name:option=value`",
                    format!("`{text}`"),
                ));
            };
            let value = value.parse::<Value>().unwrap_or_else(|_| Value::String(value.to_owned()));
            options.insert(key.to_owned(), value);
        }
        Self::new(name, options)
    }
}
