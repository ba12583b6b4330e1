"""
Forward and inverse
===================
"""
