"""What touches a sensor: loads, indenters, friction, resultants; touch, release and slip."""
