//! The checks of a scene's values, one function per part.

use super::fault::{At, Checked};
use super::{
    Camera, Channel, CloudField, GroundKind, ParticleSpec, Scene, Sky, Sun, WeatherMap, limits,
    vector,
};

/// All of a scene.
pub(super) fn scene(scene: &Scene) -> Checked {
    let root = At::Root;
    camera(&scene.camera, root.key("camera"))?;
    sun(&scene.sun, root.key("sun"))?;
    if let Sky::Uniform { radiance } = scene.sky {
        root.key("sky").key("radiance").number(radiance, &limits::IRRADIANCE)?;
    }
    if let Some(ground) = &scene.ground {
        let at = root.key("ground");
        at.key("albedo").numbers(&ground.albedo.to_array(), &limits::ALBEDO)?;
        if let GroundKind::Sea { wind_speed } = ground.kind {
            at.key("wind_speed").number(wind_speed, &limits::WIND_SPEED)?;
        }
    }
    let at = root.key("medium");
    scene.medium.phase.check().map_err(|e| at.key("phase").fault(e.to_string()))?;
    at.key("albedo").number(scene.medium.albedo, &limits::ALBEDO)?;
    if let Some(field) = &scene.clouds {
        clouds(field, root.key("clouds"))?;
    }
    root.key("output").key("exposure").number(scene.exposure, &limits::EXPOSURE)?;
    particles(&scene.particles, root)
}

/// That directions are unit vectors and a weather map has its pixels, as they are in every scene that was
/// read from a file.
pub(super) fn units(scene: &Scene) -> Checked {
    // What products of rounded rotations come to, and far below what a picture shows.
    const TOLERANCE: f64 = 1e-6;
    let is_unit = |squared: f64| (squared - 1.0).abs() <= TOLERANCE;
    let root = At::Root;
    let sun = scene.sun.direction;
    if !is_unit(sun.length_squared()) {
        let message = format!("expected a unit vector, found length {}", sun.length());
        return Err(root.key("sun").key("direction").fault(message));
    }
    let map = scene.clouds.as_ref().and_then(|clouds| clouds.weather.as_ref());
    if let Some(map) = map {
        let [width, height] = map.image.size();
        let most = limits::MOST_MAP_SIDE;
        let fits = [width, height].iter().all(|side| (1..=most).contains(side));
        if !fits || map.image.texels().len() != width as usize * height as usize {
            let message = format!("expected 1 to {most} pixels a side, found {width} x {height}");
            return Err(root.key("clouds").key("weather").key("image").fault(message));
        }
    }
    let list = root.key("particles");
    match scene.particles.iter().position(|p| !is_unit(p.orientation.length_squared())) {
        Some(index) => {
            let length = scene.particles[index].orientation.length();
            let message = format!("expected a unit quaternion, found length {length}");
            Err(list.index(index).key("orientation").fault(message))
        }
        None => Ok(()),
    }
}

fn camera(camera: &Camera, at: At<'_>) -> Checked {
    at.key("position").numbers(&camera.position.to_array(), &limits::COORDINATE)?;
    at.key("target").numbers(&camera.target.to_array(), &limits::COORDINATE)?;
    at.key("up").numbers(&camera.up.to_array(), &limits::DIRECTION)?;
    if vector::unit(camera.up).is_none() {
        return Err(at.key("up").fault("expected a direction, found [0, 0, 0]"));
    }
    if vector::unit(camera.target - camera.position).is_none() {
        return Err(at.key("target").fault("expected a point other than camera.position"));
    }
    at.key("fov_x").number(camera.fov_x, &limits::FIELD_OF_VIEW)?;
    at.key("aperture").number(camera.aperture, &limits::APERTURE)?;
    if let Some(distance) = camera.focus_distance {
        at.key("focus_distance").number(distance, &limits::FOCUS)?;
    }
    at.key("shutter").number(camera.shutter, &limits::SHUTTER)
}

fn sun(sun: &Sun, at: At<'_>) -> Checked {
    at.key("direction").numbers(&sun.direction.to_array(), &limits::DIRECTION)?;
    if vector::unit(sun.direction).is_none() {
        return Err(at.key("direction").fault("expected a direction, found [0, 0, 0]"));
    }
    at.key("irradiance").number(sun.irradiance, &limits::IRRADIANCE)?;
    at.key("angular_diameter").number(sun.angular_diameter, &limits::ANGULAR_DIAMETER)
}

fn clouds(field: &CloudField, at: At<'_>) -> Checked {
    at.key("base").number(field.base, &limits::CLOUD_BASE)?;
    at.key("thickness").number(field.thickness, &limits::CLOUD_THICKNESS)?;
    at.key("coverage").number(field.coverage, &limits::COVERAGE)?;
    at.key("extinction").number(field.extinction, &limits::EXTINCTION)?;
    at.key("feature_size").number(field.feature_size, &limits::FEATURE_SIZE)?;
    at.key("cell_size").number(field.cell_size, &limits::CELL_SIZE)?;
    at.key("cells").whole(field.cells, &limits::CELLS)?;
    if !field.cells.is_multiple_of(2) {
        return Err(at
            .key("cells")
            .fault(format!("expected an even number, found {}", field.cells)));
    }
    at.key("rings").whole(field.rings, &limits::RINGS)?;
    at.key("layers").whole(field.layers, &limits::LAYERS)?;
    if field.slots() > limits::MOST_SLOTS {
        return Err(at.fault(format!(
            "expected cells * cells * rings * layers to be at most {}, found {}",
            limits::MOST_SLOTS,
            field.slots()
        )));
    }
    at.key("particle_size").number(field.particle_size, &limits::PARTICLE_SIZE)?;
    at.key("wind").numbers(&field.wind.to_array(), &limits::WIND)?;
    at.key("evolution_time").number(field.evolution_time, &limits::EVOLUTION_TIME)?;
    let shapes = at.key("shapes");
    if field.shapes.len() > limits::MOST_FIELD_SHAPES {
        return Err(shapes.fault(format!(
            "expected at most {} names, found {}",
            limits::MOST_FIELD_SHAPES,
            field.shapes.len()
        )));
    }
    field.shapes.iter().enumerate().try_for_each(|(i, name)| shape(name, shapes.index(i)))?;
    field.weather.as_ref().map_or(Ok(()), |map| weather(map, field, at.key("weather")))
}

fn weather(map: &WeatherMap, field: &CloudField, at: At<'_>) -> Checked {
    if map.file.as_os_str().is_empty() {
        return Err(at.key("file").fault("expected a PNG image, found no name"));
    }
    let extent = at.key("extent");
    extent.numbers(&map.extent.to_array(), &limits::WEATHER_EXTENT)?;
    // Positions on the map are counted in whole pixels and shares of them: with less than a cell, they
    // could pass what 32 bits hold.
    if map.extent.min_element() < field.cell_size {
        return Err(extent.fault(format!(
            "expected at least clouds.cell_size, {} m, found {} m",
            field.cell_size,
            map.extent.min_element()
        )));
    }
    at.key("centre").numbers(&map.centre.to_array(), &limits::COORDINATE)?;
    let channels = at.key("channels");
    if !limits::MAP_CHANNELS.contains(&map.channels.len()) {
        let (least, most) = (limits::MAP_CHANNELS.start(), limits::MAP_CHANNELS.end());
        let message = format!("expected {least} to {most} names, found {}", map.channels.len());
        return Err(channels.fault(message));
    }
    for (index, channel) in map.channels.iter().enumerate() {
        if *channel != Channel::Unused && map.channels[..index].contains(channel) {
            return Err(channels.index(index).fault("expected each name once, found it twice"));
        }
    }
    at.key("noise").number(map.noise, &limits::SHARE)
}

/// Listed particles; `at` is what holds the list.
pub(super) fn particles(particles: &[ParticleSpec], at: At<'_>) -> Checked {
    let list = at.key("particles");
    if particles.len() > limits::MOST_PARTICLES {
        return Err(list.fault(format!(
            "expected at most {} particles, found {}",
            limits::MOST_PARTICLES,
            particles.len()
        )));
    }
    particles
        .iter()
        .enumerate()
        .try_for_each(|(i, particle)| self::particle(particle, list.index(i)))
}

fn particle(particle: &ParticleSpec, at: At<'_>) -> Checked {
    at.key("centre").numbers(&particle.centre.to_array(), &limits::COORDINATE)?;
    at.key("radius").number(particle.radius, &limits::RADIUS)?;
    at.key("extinction").number(particle.extinction, &limits::EXTINCTION)?;
    shape(&particle.shape, at.key("shape"))?;
    let orientation = at.key("orientation");
    orientation.numbers(&particle.orientation.to_array(), &limits::DIRECTION)?;
    if vector::unit_quaternion(particle.orientation).is_none() {
        return Err(orientation.fault("expected a quaternion [x, y, z, w] that is not zero"));
    }
    Ok(())
}

fn shape(name: &str, at: At<'_>) -> Checked {
    if name.is_empty() {
        Err(at.fault("expected the name of a shape, found nothing"))
    } else {
        Ok(())
    }
}

/// The shapes that a scene names, against those that the tables hold.
pub(super) fn shapes(scene: &Scene, known: &[&str]) -> Checked {
    let look_up = |name: &str, at: At<'_>| {
        if known.contains(&name) {
            return Ok(());
        }
        let name = super::fault::tidy(name, 100);
        Err(at.fault(format!("the tables hold no shape `{name}`, only {}", known.join(", "))))
    };
    let root = At::Root;
    if let Some(field) = &scene.clouds {
        let list = root.key("clouds");
        let list = list.key("shapes");
        for (i, name) in field.shapes.iter().enumerate() {
            look_up(name, list.index(i))?;
        }
    }
    let list = root.key("particles");
    for (i, particle) in scene.particles.iter().enumerate() {
        look_up(&particle.shape, list.index(i).key("shape"))?;
    }
    Ok(())
}
