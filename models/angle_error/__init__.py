"""Stated errors of joint angles."""
