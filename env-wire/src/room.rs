//! How much of a server's memory environments may take: those of one session, and all of them together.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::fault::Fault;

/// How large environments may be that are counted together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Cells of their pastures, each a square metre.
    pub max_cells: u64,
    /// Their weeds.
    pub max_weeds: u64,
}

impl Bounds {
    /// Those of a session, where nobody says otherwise.
    pub const OF_SESSION: Self = Self { max_cells: 1 << 28, max_weeds: 1 << 22 };
    /// Those of all sessions together, where nobody says otherwise.
    pub const OF_ALL: Self = Self { max_cells: 1 << 30, max_weeds: 1 << 24 };
}

/// What environments take.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Size {
    /// Cells; twice those of environments whose percepts are told, since it is kept what was told.
    pub(crate) cells: u64,
    pub(crate) weeds: u64,
}

/// The room that all sessions of a server share.
#[derive(Debug)]
pub struct Room {
    session: Bounds,
    all: Bounds,
    used: Mutex<Size>,
}

/// A session's part of it, given back with this.
#[derive(Debug)]
pub(crate) struct Place {
    room: Arc<Room>,
    size: Size,
}

impl Room {
    /// Room for as much as `all`, of which a session has `session` at most.
    #[must_use]
    pub fn new(session: Bounds, all: Bounds) -> Arc<Self> {
        // What would never find a place is refused as too large, not until there is room.
        let session = Bounds {
            max_cells: session.max_cells.min(all.max_cells),
            max_weeds: session.max_weeds.min(all.max_weeds),
        };
        Arc::new(Self { session, all, used: Mutex::default() })
    }

    /// How much a session may have.
    pub(crate) fn session(&self) -> Bounds {
        self.session
    }

    /// A place for as much as nothing.
    pub(crate) fn place(self: &Arc<Self>) -> Place {
        Place { room: Arc::clone(self), size: Size::default() }
    }

    fn used(&self) -> MutexGuard<'_, Size> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Place {
    pub(crate) fn size(&self) -> Size {
        self.size
    }

    /// How much a session may have.
    pub(crate) fn session(&self) -> Bounds {
        self.room.session
    }

    /// Makes it so large; less is always possible.
    ///
    /// # Errors
    ///
    /// [`Fault::Capacity`] if the others leave too little room; it is then as it was.
    pub(crate) fn resize(&mut self, size: Size) -> Result<(), Fault> {
        let most = self.room.all;
        let mut used = self.room.used();
        let (cells, weeds) = (used.cells - self.size.cells, used.weeds - self.size.weeds);
        for (others, before, now, most, of, setting) in [
            (
                cells,
                self.size.cells,
                size.cells,
                most.max_cells,
                "cells of pastures",
                "max_all_cells",
            ),
            (weeds, self.size.weeds, size.weeds, most.max_weeds, "weeds", "max_all_weeds"),
        ] {
            if now > before && others.saturating_add(now) > most {
                return Err(Fault::full(others + before, most, of, setting));
            }
        }
        *used = Size { cells: cells + size.cells, weeds: weeds + size.weeds };
        self.size = size;
        Ok(())
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut used = self.room.used();
        used.cells -= self.size.cells;
        used.weeds -= self.size.weeds;
    }
}
