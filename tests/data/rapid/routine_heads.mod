MODULE RoutineHeads
  LOCAL PROC a()
  ENDPROC
  PROC b(num n,VAR num v,PERS num p,INOUT num i,num list{*},num cube{*,*,*},switch s)
  ENDPROC
  FUNC robtarget c(robtarget p\num x|num y\switch s)
    RETURN p;
  ENDFUNC
  LOCAL FUNC bool d()
    RETURN TRUE;
  ENDFUNC
  PROC e(\num first)
  ENDPROC
  TRAP g
  ENDTRAP
ENDMODULE
