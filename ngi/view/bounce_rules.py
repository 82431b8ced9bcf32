"""What an exported network's file says of specular bounces and of the caustics they throw."""


def specular_rule(max_depth: int) -> str:
    """How far `ngi.render.specular` follows a camera ray. max_depth: of the scene, -1: any."""
    from ngi.render.specular import MAX_SPECULAR_BOUNCES, SPECULAR_ROUGHNESS  # brings Mitsuba

    return (
        "each camera ray is followed over specular bounces; all channels but throughput, "
        "chain_roughness and emission are of the hit where they end, the first that is not "
        "specular. Specular are conductors, dielectrics and thin dielectrics, smooth or of alpha "
        f"<= {SPECULAR_ROUGHNESS:g} at the hit, which count as smooth; a conductor's back only if "
        "it is two-sided with the same BSDF on both; none with a bump or normal map, no plastic, "
        "no principled BSDF. At a dielectric the ray takes the stronger branch by Fresnel's "
        "equations: reflection if its share is above 0.5, else transmission (a thin one's share "
        "holds all reflections inside it). The throughput is the product of the weights: the "
        "share reflected times specular_reflectance, or the rest times specular_transmittance "
        "and, but for thin ones, (n1 / n2)^2, n1 being the index on the ray's side. The ray "
        f"ends after {_bounces(MAX_SPECULAR_BOUNCES, max_depth, 1)}, whatever is hit then; "
        "'direct' is 0 where no segment of the scene's max_depth is left for it, but for what "
        "rough surfaces show of emitters"
    )


def caustics_rule(max_depth: int) -> str:
    """What `ngi.render.caustics` adds to the direct light. max_depth: as above."""
    from ngi.render.caustics import MAX_BOUNCES
    from ngi.render.specular import SPECULAR_ROUGHNESS

    return (
        "caustics are in it: what a diffuse surface sends of the light that conductors and "
        f"dielectrics of alpha <= {SPECULAR_ROUGHNESS:g} (> 0 for light without extent) throw "
        f"onto it, along the stronger branch and over at most {_bounces(MAX_BOUNCES, max_depth, 2)}"
    )


def _bounces(most: int, max_depth: int, others: int) -> str:
    fewer = f", or {max_depth - others} (max_depth - {others}) if that is fewer"
    return f"{most} bounces{fewer if max_depth >= 0 else ''}"
