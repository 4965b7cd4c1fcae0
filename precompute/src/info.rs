//! `precompute info`: what is in a table file.

use std::path::PathBuf;

use clap::Args;
use cumuli::Result;
use cumuli::tables::TableSet;

use crate::print;

/// Arguments of `precompute info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Table file
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

/// Runs the command.
pub fn run(args: &InfoArgs) -> Result<()> {
    let tables = TableSet::load(&args.file)?;
    for line in tables.summary() {
        print(&line)?;
    }
    Ok(())
}
