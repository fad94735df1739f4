//! Writes the seeds of every target into a folder of its own under `corpus`.

use std::fs;
use std::path::Path;

fn main() -> std::io::Result<()> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for (target, name, bytes) in swath_fuzz::seeds::all() {
        fs::create_dir_all(corpus.join(&target))?;
        fs::write(corpus.join(&target).join(name), bytes)?;
    }
    Ok(())
}
