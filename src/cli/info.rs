//! `cumuli info`: what pictures are made with on this machine.

use std::path::PathBuf;

use clap::Args;

use super::print;
use crate::error::Result;
use crate::gpu::Gpu;

/// Arguments of `cumuli info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Table file made by precompute; without it, the built-in tables
    #[arg(long, value_name = "FILE")]
    pub tables: Option<PathBuf>,
}

/// Runs the command. Fails where there is no adapter, so scripts can ask for one with it.
pub(super) fn run(args: &InfoArgs) -> Result<()> {
    let tables = super::engine::tables_summary(args.tables.as_deref())?;
    let gpu = Gpu::headless()?;
    let adapter = gpu.adapter.get_info();
    let limits = gpu.device.limits();
    let mib = |bytes: u64| format!("{} MiB", bytes >> 20);
    let features = gpu.device.features();
    let timer = if features.contains(wgpu::Features::TIMESTAMP_QUERY) { "yes" } else { "no" };
    let lines = [
        ("cumuli", env!("CARGO_PKG_VERSION").to_owned()),
        ("adapter", adapter.name),
        ("kind", format!("{:?}", adapter.device_type)),
        ("backend", adapter.backend.to_string()),
        ("driver", format!("{} {}", adapter.driver, adapter.driver_info)),
        ("timestamps", timer.to_owned()),
        ("largest picture", format!("{0} x {0}", limits.max_texture_dimension_2d)),
        ("largest buffer", mib(limits.max_buffer_size)),
        ("largest binding", mib(limits.max_storage_buffer_binding_size)),
        ("workgroup memory", format!("{} KiB", limits.max_compute_workgroup_storage_size >> 10)),
        ("workgroup size", limits.max_compute_invocations_per_workgroup.to_string()),
    ];
    for (name, value) in lines {
        print(&format!("{name:17} {}", value.trim()))?;
    }
    for line in tables {
        print(&line)?;
    }
    Ok(())
}
