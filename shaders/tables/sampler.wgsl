// The sampler that all tables are read with: linear, clamped to the edge.
#define_import_path cumuli::table_sampler

@group(1) @binding(2) var table_sampler: sampler;
