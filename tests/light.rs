//! The light room: spherical harmonics, the sun's place, the sky's radiance, night, exposure, and all of it together.

use std::f32::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

use canopy::light::moon::celestial_rotation;
use canopy::light::sh;
use canopy::light::sun::{direction_from, disc_fraction, refraction_deg};
use canopy::light::*;
use canopy::math::{SphereQuadrature, luminance};
use chrono::{DateTime, Utc};
use glam::{Quat, Vec3};
use proptest::prelude::*;

static EARTH: LazyLock<Atmosphere> =
    LazyLock::new(|| Atmosphere::new(AtmosphereParams::default()).expect("the Earth's parameters are in range"));

fn sun(elevation_deg: f64) -> Vec3 {
    direction_from(PI.into(), elevation_deg.to_radians())
}

fn state(elevation_deg: f64, moon: MoonSetting) -> LightState {
    let sun = SunPosition::from_degrees(180.0, elevation_deg).unwrap();
    let moon = moon.moon(None, &sun).unwrap();
    LightState::new(&EARTH, sun, moon, &LightSettings { observer_height_m: 200.0, ..LightSettings::default() }).unwrap()
}

fn instant(text: &str) -> DateTime<Utc> {
    text.parse().unwrap()
}

// ---- spherical harmonics -------------------------------------------------------------------------------------------

#[test]
fn basis_is_orthonormal_to_six_bands() {
    let rule = SphereQuadrature::new(12, 24);
    let mut gram = [[0.0f64; 36]; 36];
    for (direction, solid_angle) in rule.sphere() {
        let y = sh::basis::<36>(*direction);
        for (row, a) in gram.iter_mut().zip(y) {
            for (g, b) in row.iter_mut().zip(y) {
                *g += f64::from(a) * f64::from(b) * f64::from(*solid_angle);
            }
        }
    }
    for (i, row) in gram.iter().enumerate() {
        for (j, g) in row.iter().enumerate() {
            let want = if i == j { 1.0 } else { 0.0 };
            assert!((g - want).abs() < 1e-5, "<y{i}, y{j}> = {g}");
        }
    }
}

#[test]
fn polynomials_of_the_page_are_the_recurrence() {
    for (direction, _) in SphereQuadrature::new(5, 9).sphere() {
        let (a, b) = (sh::basis9(*direction), sh::basis::<9>(*direction));
        for i in 0..9 {
            assert!((a[i] - b[i]).abs() < 1e-6, "i {i} at {direction}: {} and {}", a[i], b[i]);
        }
    }
    // Poles are not singular, incomplete bands are left black.
    assert!(sh::basis::<36>(Vec3::Y).iter().all(|v| v.is_finite()));
    let mut out = [7.0; 12];
    sh::basis_into(Vec3::X, &mut out);
    assert_eq!(out[9..], [0.0; 3]);
}

#[test]
fn constant_and_clamped_cosine_project_to_their_analytic_coefficients() {
    let rule = SphereQuadrature::new(16, 32);
    let mut c = [0.0f32; 36];
    sh::project(&rule, &mut c, |_| 2.0f32);
    assert!((c[0] - 2.0 * (4.0 * PI).sqrt()).abs() < 2e-5);
    assert!(c[1..].iter().all(|v| v.abs() < 1e-5));
    assert!((sh::evaluate(&c, Vec3::new(0.6, 0.0, 0.8)) - 2.0).abs() < 1e-5);

    sh::project(&rule, &mut c, |d| d.y.max(0.0));
    for l in 0..6usize {
        for m in -(l as i32)..=l as i32 {
            let got = c[(l * (l + 1)).saturating_add_signed(m as isize)];
            // A zonal kernel's coefficient is A_l times y_l0 at the pole.
            let want = if m == 0 { sh::cosine_coefficient(l) * ((2 * l + 1) as f32 / (4.0 * PI)).sqrt() } else { 0.0 };
            assert!((got - want).abs() < 1e-5, "l {l}, m {m}: {got} instead of {want}");
        }
    }
}

#[test]
fn rotation_is_the_projection_of_the_rotated_function() {
    let rule = SphereQuadrature::new(16, 32);
    let f = |d: Vec3| (d.x + 0.3 * d.y).powi(3) + d.z * d.x * d.y - 0.4 * d.z.powi(5) + d.x;
    for yaw in [0.3f32, -1.7, 3.0, 40.0] {
        let back = Quat::from_rotation_y(yaw).inverse();
        let (mut a, mut b) = ([0.0f32; 36], [0.0f32; 36]);
        sh::project(&rule, &mut a, f);
        sh::rotate_y(&mut a, yaw);
        sh::project(&rule, &mut b, |d| f(back * d));
        for i in 0..36 {
            assert!((a[i] - b[i]).abs() < 2e-5, "yaw {yaw}, i {i}: {} and {}", a[i], b[i]);
        }
    }
}

#[test]
fn irradiance_of_a_hemisphere_and_of_the_whole_sphere() {
    let rule = SphereQuadrature::new(16, 32);
    let mut c = [Vec3::ZERO; 9];
    sh::project(&rule, &mut c, |_| Vec3::ONE);
    assert!((sh::irradiance(&c, Vec3::X) - Vec3::splat(PI)).length() < 1e-4);
    sh::project(&rule, &mut c, |d| if d.y > 0.0 { Vec3::ONE } else { Vec3::ZERO });
    assert!((sh::irradiance(&c, Vec3::Y).x - PI).abs() < 0.01 * PI);
    assert!((sh::irradiance(&c, Vec3::X).x - FRAC_PI_2).abs() < 0.01 * PI);
    let mut convolved = c;
    sh::convolve_cosine(&mut convolved);
    let n = Vec3::new(0.2, 0.5, -0.7).normalize();
    assert!((sh::evaluate(&convolved, n) - sh::irradiance(&c, n)).length() < 1e-5);
}

#[test]
fn window_makes_a_single_light_nonnegative_at_the_documented_loss() {
    let light = Vec3::new(0.3, 0.8, -0.5).normalize();
    let mut c = sh::basis9(light).map(Vec3::splat);
    c[8].x = f32::NAN;
    let factors = sh::window_nonnegative(&mut c);
    assert_eq!((factors.x, c[4].x), (0.0, 0.0));
    assert!((factors.y - 0.864).abs() < 0.002, "{factors}");
    let rule = SphereQuadrature::new(40, 80);
    let lowest = rule.sphere().iter().map(|(d, _)| sh::irradiance(&c, *d).y);
    let lowest = lowest.fold(f32::INFINITY, f32::min);
    assert!((-1e-5..1e-3).contains(&lowest), "{lowest}");
}

proptest! {
    #[test]
    fn smallest_irradiance_is_the_smallest_of_all_normals(c in prop::array::uniform9(-1.0f32..1.0)) {
        let exact = sh::min_irradiance(&c);
        let rgb = c.map(Vec3::splat);
        let rule = SphereQuadrature::new(24, 48);
        let seen = rule.sphere().iter().map(|(d, _)| sh::irradiance(&rgb, *d).x).fold(f32::INFINITY, f32::min);
        prop_assert!(exact <= seen + 1e-4 && exact >= seen - 0.02, "{exact} against {seen}");
    }
}

// ---- the sun and the moon ------------------------------------------------------------------------------------------

#[test]
fn sun_stands_where_the_spa_report_says() {
    // Reda & Andreas 2003, appendix A.5.
    let observer = Observer {
        latitude_deg: 39.742_476,
        longitude_deg: -105.1786,
        height_m: 1830.14,
        pressure_mbar: 820.0,
        temperature_c: 11.0,
    };
    let at = SunPosition::at_with_delta_t(instant("2003-10-17T19:30:30Z"), &observer, 67.0).unwrap();
    assert!((90.0 - at.elevation.to_degrees() - 50.111_62).abs() < 1e-4, "{}", 90.0 - at.elevation.to_degrees());
    assert!((at.azimuth.to_degrees() - 194.340_24).abs() < 1e-4, "{}", at.azimuth.to_degrees());
}

#[test]
fn directions_are_east_up_and_north() {
    assert!((direction_from(0.0, 0.0) - Vec3::NEG_Z).length() < 1e-6);
    assert!((direction_from(std::f64::consts::FRAC_PI_2, 0.0) - Vec3::X).length() < 1e-6);
    assert!((direction_from(1.0, std::f64::consts::FRAC_PI_2) - Vec3::Y).length() < 1e-6);
    // Noon in the north: the sun stands in the south, and in the morning in the east.
    let freiburg = Observer::new(48.0, 7.85, 280.0).unwrap();
    assert!(SunPosition::at(instant("2024-06-21T11:30:00Z"), &freiburg).unwrap().direction().z > 0.3);
    assert!(SunPosition::at(instant("2024-06-21T05:00:00Z"), &freiburg).unwrap().direction().x > 0.5);
}

#[test]
fn impossible_requests_are_refused_by_name() {
    let message = |e: LightError| e.to_string();
    assert!(message(Observer::new(91.0, 0.0, 0.0).unwrap_err()).contains("latitude is 91"));
    assert!(message(Observer::new(0.0, 200.0, 0.0).unwrap_err()).contains("longitude"));
    assert!(message(Observer::new(0.0, 0.0, f64::NAN).unwrap_err()).contains("height"));
    assert!(message(SunPosition::from_degrees(0.0, 95.0).unwrap_err()).contains("elevation"));
    let here = Observer::new(0.0, 0.0, 0.0).unwrap();
    assert!(matches!(SunPosition::at(instant("9000-01-01T00:00:00Z"), &here), Err(LightError::Instant { .. })));
    let air = AtmosphereParams { top_height_m: -1.0, ..AtmosphereParams::default() };
    assert!(message(Atmosphere::new(air).unwrap_err()).contains("top of the atmosphere"));
    let settings = LightSettings { observer_height_m: 1e6, ..LightSettings::default() };
    let noon = SunPosition::from_degrees(180.0, 60.0).unwrap();
    assert!(LightState::new(&EARTH, noon, None, &settings).is_err());
}

#[test]
fn refraction_is_continuous_and_keeps_the_order_of_elevations() {
    assert!((refraction_deg(0.0, 1010.0, 10.0) - 0.48).abs() < 0.01);
    let mut last = -20.0;
    for i in 0..20_000 {
        let e = -15.0 + f64::from(i) * 0.005;
        let apparent = e + refraction_deg(e, 1013.0, 15.0);
        assert!(apparent > last && (i == 0 || apparent - last < 0.01), "at {e}: {last} then {apparent}");
        last = apparent;
    }
}

#[test]
fn disc_sets_smoothly() {
    let r = 0.00465;
    assert_eq!((disc_fraction(r, r), disc_fraction(0.0, r), disc_fraction(-r, r)), (1.0, 0.5, 0.0));
    assert_eq!(disc_fraction(f64::NAN, r), 0.0);
    assert!(disc_fraction(0.5 * r, r) > 0.8);
}

#[test]
fn moon_is_full_at_an_eclipse_and_new_at_another() {
    let here = Observer::new(48.0, 7.85, 280.0).unwrap();
    // Total eclipses: of the moon on 2018-07-27 20:22 UT, of the sun on 2024-04-08 18:17 UT.
    let full = Moon::at(instant("2018-07-27T20:22:00Z"), &here).unwrap();
    assert!(full.phase_angle.to_degrees() < 1.5 && full.lit_fraction() > 0.999, "{}", full.phase_angle.to_degrees());
    let sun = SunPosition::at(instant("2018-07-27T20:22:00Z"), &here).unwrap();
    assert!(full.direction.dot(sun.direction()) < -0.999);
    let lux = luminance(full.illuminance * EARTH.disc_transmittance(Vec3::Y, 0.0));
    assert!((0.18..0.32).contains(&lux), "{lux}");
    let new = Moon::at(instant("2024-04-08T18:17:00Z"), &here).unwrap();
    assert!(new.phase_angle.to_degrees() > 177.0);
    assert!(luminance(new.illuminance) < 2e-4);
}

#[test]
fn the_pole_of_the_stars_is_as_high_as_the_latitude() {
    let here = Observer::new(48.0, 7.85, 280.0).unwrap();
    let to_stars = celestial_rotation(instant("2024-03-01T22:00:00Z"), &here);
    let pole = to_stars.transpose() * Vec3::Z;
    assert!((pole - direction_from(0.0, 48f64.to_radians())).length() < 1e-5, "{pole}");
    // The sun at the equinox stands at the vernal point: through another door, the same sidereal time.
    let equinox = instant("2024-03-20T12:00:00Z");
    let sun = SunPosition::at(equinox, &here).unwrap().direction();
    let seen = celestial_rotation(equinox, &here) * sun;
    assert!(seen.dot(Vec3::X) > 0.9999, "{seen}");
}

// ---- the sky -------------------------------------------------------------------------------------------------------

/// Horizontal illuminances of clear skies as handbooks tabulate them by the sun's elevation (day and civil twilight
/// as in Seidelmann 1992, chapter 9; night as in Leinert et al. 1998). Skies vary by some ten percent, twilights more.
#[test]
fn illuminances_are_those_of_published_tables() {
    let night = NightSky::default().horizontal_illuminance(&EARTH);
    for (elevation, lux, factor) in [
        (60.0, 1.05e5, 1.15),
        (30.0, 5.1e4, 1.15),
        (10.0, 1.09e4, 1.35),
        (0.0, 6.5e2, 1.6),
        (-6.0, 3.4, 1.8),
        (-12.0, 8.9e-3, 1.8),
        (-18.0, 6.5e-4, 1.8),
    ] {
        let got = luminance(EARTH.horizontal_illuminance(sun(elevation)) + night);
        println!("sun at {elevation}: {got} lux, published {lux}");
        assert!(got < lux * factor && got > lux / factor, "sun at {elevation}: {got} lux, published {lux}");
    }
    let diffuse = luminance(EARTH.diffuse_illuminance(sun(60.0)));
    assert!((1e4..2e4).contains(&diffuse), "{diffuse}");
    // Zenith of a clear sky with the sun 30 degrees up: 1,000 to 3,000 nits (CIE 110-1994), and blue.
    let zenith = EARTH.radiance(Vec3::Y, sun(30.0), 0.0);
    assert!((1e3..3e3).contains(&luminance(zenith)) && zenith.z > 2.5 * zenith.x, "{zenith}");
}

#[test]
fn dusk_has_its_colours() {
    let horizon = EARTH.radiance(Vec3::Z, sun(1.0), 100.0);
    assert!(horizon.x > 2.0 * horizon.y && horizon.y > 2.0 * horizon.z, "towards the setting sun: {horizon}");
    let blue_hour = EARTH.radiance(Vec3::Y, sun(-5.0), 100.0);
    assert!(blue_hour.z > 2.0 * blue_hour.x && blue_hour.y > blue_hour.x, "zenith of the blue hour: {blue_hour}");
    // The shadow of the Earth: opposite the sun, the sky 2 degrees up is darker than 12 degrees up.
    let opposite = |e: f64| luminance(EARTH.radiance(direction_from(0.0, e.to_radians()), sun(-3.0), 100.0));
    assert!(opposite(2.0) < 0.9 * opposite(12.0));
}

#[test]
fn steps_along_the_ray_converge() {
    let mut worst = [0.0f32; 2];
    for (k, elevations) in [[60.0, 20.0, 5.0], [0.0, -4.0, -8.0]].iter().enumerate() {
        for elevation in elevations {
            for azimuth in [0.0f64, 1.5, 3.0] {
                for e in [1.0f64, 5.0, 20.0, 60.0] {
                    let view = direction_from(PI as f64 + azimuth, e.to_radians());
                    let fine = EARTH.radiance_with_steps(view, sun(*elevation), 50.0, 800);
                    let coarse = EARTH.radiance(view, sun(*elevation), 50.0);
                    let error = ((coarse - fine).abs() / fine).max_element();
                    worst[k] = worst[k].max(error);
                }
            }
        }
    }
    println!("error of 40 steps against 800: {:.4} by day, {:.4} at dusk", worst[0], worst[1]);
    assert!(worst[0] < 0.01 && worst[1] < 0.08, "{worst:?}");
}

#[test]
fn picture_agrees_with_direct_evaluation() {
    for (elevation, mean_limit, worst_limit) in [(50.0, 0.004, 0.05), (5.0, 0.006, 0.08), (-4.0, 0.008, 0.08)] {
        let s = sun(elevation);
        let view = EARTH.sky_view(s, EARTH.params().solar_illuminance, 150.0);
        assert_eq!(view.texels.len(), SkyView::WIDTH * SkyView::HEIGHT);
        let (mut sum, mut count, mut worst) = (0.0, 0, 0.0f32);
        for (d, _) in SphereQuadrature::new(20, 41).upper() {
            let direct = EARTH.radiance(*d, s, 150.0);
            let error = ((view.sample(*d) - direct).abs() / direct).max_element();
            worst = worst.max(error);
            sum += error;
            count += 1;
        }
        let mean = sum / count as f32;
        println!("sun at {elevation}: picture against direct, mean {mean:.5}, worst {worst:.4}");
        assert!(mean < mean_limit && worst < worst_limit, "sun at {elevation}: mean {mean}, worst {worst}");
    }
}

#[test]
fn picture_coordinates_invert_and_its_ends_meet() {
    let view = EARTH.sky_view(direction_from(4.0, 0.3), Vec3::ONE, 10.0);
    for (column, row) in [(0.5, 72.0), (64.0, 10.0), (127.0, 95.0), (50.5, 71.5), (100.25, 40.0)] {
        let at = view.coordinates(view.direction(column, row));
        assert!((at.x - column).abs() < 0.02 && (at.y - row).abs() < 0.02, "({column}, {row}) became {at}");
    }
    for row in view.texels.chunks(SkyView::WIDTH) {
        assert_eq!(row[0], row[SkyView::WIDTH - 1]);
    }
    // The brightest texel of the upper sky is in the sun's column.
    let upper = &view.texels[..SkyView::WIDTH * SkyView::HORIZON_ROW];
    let brightest = (0..upper.len()).max_by(|a, b| upper[*a][1].total_cmp(&upper[*b][1])).unwrap();
    assert_eq!(brightest % SkyView::WIDTH, 64);
    let half = view.to_rgba16f(1e9);
    assert!(half.iter().flatten().all(|v| v.is_finite()));
}

#[test]
fn ground_below_meets_the_horizon() {
    for elevation in [40.0, 2.0, -5.0] {
        let above = EARTH.radiance(direction_from(1.0, 1e-5), sun(elevation), 300.0);
        let below = EARTH.radiance(direction_from(1.0, -1e-5), sun(elevation), 300.0);
        assert!(((above - below).abs() / above).max_element() < 5e-3, "sun at {elevation}: {above} and {below}");
    }
    let down = EARTH.radiance(Vec3::NEG_Y, sun(60.0), 2.0);
    let lit = EARTH.params().ground_albedo / PI * EARTH.horizontal_illuminance(sun(60.0));
    assert!(((down - lit).abs() / lit).max_element() < 0.01, "{down} and {lit}");
}

#[test]
fn horizontal_illuminance_of_table_and_picture_agree() {
    for elevation in [60.0, 10.0, -3.0, -9.0] {
        let s = state(elevation, MoonSetting::None);
        let (picture, table) = (luminance(s.horizontal_illuminance()), s.adaptation_illuminance);
        assert!((picture / table - 1.0).abs() < 0.12, "sun at {elevation}: {picture} and {table}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn radiance_is_finite_and_never_negative(
        view in prop::array::uniform3(-1.0f32..1.0),
        azimuth in 0.0f64..360.0,
        elevation in -90.0f64..=90.0,
        height in -1e3f64..2e5,
    ) {
        let s = SunPosition::from_degrees(azimuth, elevation).unwrap().direction();
        for v in [
            EARTH.radiance(Vec3::from(view), s, height),
            EARTH.sun_illuminance(s, height),
            EARTH.diffuse_illuminance(s),
            NightSky::default().radiance(&EARTH, Vec3::from(view), height),
        ] {
            prop_assert!(v.is_finite() && v.min_element() >= 0.0, "{v}");
        }
    }

    #[test]
    fn visibility_gives_valid_air(km in prop::num::f64::ANY) {
        prop_assert!(AtmosphereParams::with_visibility_km(km).validate().is_ok());
    }
}

#[test]
fn radiance_survives_what_is_not_a_direction() {
    for bad in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        let v = EARTH.radiance(bad, bad, f64::NAN);
        assert!(v.is_finite() && v.min_element() >= 0.0);
        assert!(EARTH.horizontal_illuminance(bad).is_finite());
    }
}

// ---- everything together -------------------------------------------------------------------------------------------

#[test]
fn light_is_continuous_as_the_sun_sinks() {
    for moon in [MoonSetting::None, MoonSetting::Full] {
        let mut last: Option<LightState> = None;
        let mut elevation = 1.0;
        while elevation > -6.0 {
            let now = state(elevation, moon);
            if let Some(last) = &last {
                let ratio = |a: Vec3, b: Vec3| luminance(a) / luminance(b);
                let total = ratio(now.horizontal_illuminance(), last.horizontal_illuminance());
                let zenith = ratio(now.sky_view.sample(Vec3::Y), last.sky_view.sample(Vec3::Y));
                assert!((0.8..1.001).contains(&total), "total at {elevation}: {total}");
                assert!((0.8..1.001).contains(&zenith), "zenith at {elevation}: {zenith}");
                assert!(now.ev100 < last.ev100 && last.ev100 - now.ev100 < 0.3, "exposure at {elevation}");
            }
            last = Some(now);
            elevation -= 0.13;
        }
    }
    // Where shadows change from the sun's to the moon's, neither is seen.
    for (elevation, key) in [(-0.2660, KeyLight::Sun), (-0.2672, KeyLight::Moon)] {
        let s = state(elevation, MoonSetting::Full);
        let (lost, left) = (luminance(s.key_illuminance), luminance(s.sky_illuminance));
        assert!(s.key == key && lost < 1e-4 * left, "{:?} with {lost} lux beside {left}", s.key);
    }
}

/// What is displayed of the zenith and of white ground, up to a factor.
fn displayed(elevation_deg: f64, moon: MoonSetting) -> [f32; 2] {
    let now = state(elevation_deg, moon);
    let exposure = (-now.ev100).exp2();
    [now.sky_view.sample(Vec3::Y), now.horizontal_illuminance()].map(|light| luminance(light) * exposure)
}

#[test]
fn a_night_turns_into_day_without_a_step() {
    const MOST: f32 = 1.11;
    for moon in [MoonSetting::None, MoonSetting::Full] {
        let elevations = (-72..=36).map(|quarter| 0.25 * f64::from(quarter));
        let images: Vec<_> = elevations.map(|elevation| (elevation, displayed(elevation, moon))).collect();
        for pair in images.windows(2) {
            let ((_, before), (elevation, after)) = (pair[0], pair[1]);
            for (name, (before, after)) in ["zenith", "ground"].into_iter().zip(before.into_iter().zip(after)) {
                let step = (after / before).max(before / after);
                assert!(step <= MOST, "{name} at {elevation} degrees, {moon:?}: a step of {step}");
            }
        }
    }
    // A control: over two degrees the light changes by more.
    let [[before, _], [after, _]] = [-4.0, -2.0].map(|elevation| displayed(elevation, MoonSetting::None));
    assert!((after / before).max(before / after) > MOST, "{before} {after}");
}

#[test]
fn exposure_is_monotone_and_night_stays_dark_and_readable() {
    let mut last = f32::INFINITY;
    for i in 0..30 {
        let s = state(80.0 - 4.0 * f64::from(i), MoonSetting::Full);
        assert!(s.ev100 <= last + 1e-4, "sun at {}: {} after {last}", 80 - 4 * i, s.ev100);
        last = s.ev100;
    }
    let shown = |s: &LightState| luminance(s.horizontal_illuminance()) * s.exposure;
    let day = shown(&state(60.0, MoonSetting::None));
    let moonlit = shown(&state(-45.0, MoonSetting::Full)) / day;
    let starlit = shown(&state(-45.0, MoonSetting::None)) / day;
    assert!((0.10..0.22).contains(&moonlit), "moonlit {moonlit}");
    assert!((0.03..0.08).contains(&starlit), "starlit {starlit}");
}

#[test]
fn key_light_is_the_sun_until_its_disc_is_down() {
    assert_eq!(state(-0.2, MoonSetting::Full).key, KeyLight::Sun);
    let night = state(-30.0, MoonSetting::Full);
    assert_eq!(night.key, KeyLight::Moon);
    assert!(night.key_direction.y > 0.4 && luminance(night.key_illuminance) > 0.1);
    assert!(night.night.moon.is_some());
    let moonless = state(-30.0, MoonSetting::None);
    assert_eq!((moonless.key, moonless.key_illuminance), (KeyLight::Sun, Vec3::ZERO));
}

#[test]
fn harmonics_carry_the_sky() {
    for elevation in [50.0, 5.0, -4.0, -20.0] {
        let s = state(elevation, MoonSetting::None);
        let up = luminance(sh::irradiance(&s.sky_sh, Vec3::Y));
        let direct = luminance(s.sky_illuminance);
        assert!((up / direct - 1.0).abs() < 0.08, "sun at {elevation}: {up} against {direct}");
        for (normal, _) in SphereQuadrature::new(10, 20).sphere() {
            assert!(sh::irradiance(&s.sky_sh, *normal).min_element() >= -1e-3 * direct);
        }
    }
    // A wall that faces the low sun gets more skylight than one that turns away.
    let s = state(8.0, MoonSetting::None);
    assert!(luminance(sh::irradiance(&s.sky_sh, Vec3::Z)) > 1.3 * luminance(sh::irradiance(&s.sky_sh, Vec3::NEG_Z)));
}

#[test]
fn fog_at_the_horizon_is_the_sky() {
    let s = state(20.0, MoonSetting::None);
    let horizon = s.sky_view.sample(Vec3::X);
    assert!((s.fog_radiance(Vec3::new(1.0, -0.02, 0.0)) / horizon - Vec3::ONE).abs().max_element() < 1e-3);
    // Visibility is where 2 % are left; one exponential stands for those of air and aerosol.
    assert!((s.fog.extinction.y * 5e4 - 3.912).abs() < 0.05);
    for top in [500.0f32, 1000.0, 2000.0] {
        let exact: f32 =
            (0..200).map(|i| EARTH.extinction(f64::from((i as f32 + 0.5) * top / 200.0)).y).sum::<f32>() * top / 200.0;
        let h = s.fog.scale_height_m;
        let fitted = s.fog.extinction.y * h * (1.0 - (-top / h).exp());
        println!("fog depth to {top} m: {fitted} against {exact}");
        assert!((fitted / exact - 1.0).abs() < 0.05, "to {top} m: {fitted} against {exact}");
    }
}

#[test]
fn same_light_from_any_number_of_threads() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let three = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let make = || state(-3.0, MoonSetting::Full);
    assert_eq!(one.install(make), three.install(make));
}
